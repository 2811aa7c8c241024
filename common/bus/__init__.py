"""Message transport: the bus protocol, its Zenoh implementation, and the in-process bus used offline."""
