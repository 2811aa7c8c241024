def test_too_large_pictures_are_refused_before_one_is_read(tmp_path: Path) -> None:
    """A sparse file has few blocks on the disk, and would take all memory."""
    path = tmp_path / "large.npy"
    np.lib.format.open_memmap(path, mode="w+", dtype=np.uint8, shape=(1, 8193, 8192, 3))
    with pytest.raises(OpenError, match=r"large\.npy: pictures of 8192 x 8193 px: allowed: at most 67108864 pixels"):
        next(rendered_frames(Rendered(path, 10.0), 10.0, FIT, offline()))
