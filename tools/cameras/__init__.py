"""What cameras there are: those of this machine and network streams, tried and described."""
