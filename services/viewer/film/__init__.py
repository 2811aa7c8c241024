"""Films of a camera: recorded on its machine, at the command of who films."""
