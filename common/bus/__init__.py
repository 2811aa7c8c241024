"""Moving messages: the bus protocol, Zenoh, and the in-process bus used offline."""
