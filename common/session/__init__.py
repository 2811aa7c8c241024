"""The steps of a rig's services without a network."""
