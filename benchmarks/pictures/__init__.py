"""Pictures of the documentation, drawn by `python -m benchmarks --pictures NAME`."""

DRAWN = {  # by name: function of a folder
    "joints": "benchmarks.pictures.joints:draw",
    "page": "benchmarks.pictures.page:draw",
    "page-of-take": "benchmarks.pictures.page:draw_take",
    "paper": "benchmarks.pictures.paper:draw",
    "terminal": "benchmarks.pictures.terminal:draw",
    "windows": "benchmarks.pictures.page:draw_windows",
}
