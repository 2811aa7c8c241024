"""Recording: rigs run, films, takes of a network, replay."""
