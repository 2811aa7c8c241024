"""Takes of the synthetic actor, to learn postures from and to test their recognition with."""
