"""How much the deployment can take, and which settings of Zenoh that hangs on.  See `__main__`."""
