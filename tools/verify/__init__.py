"""`zenocap verify`: recompute the derived messages of a take with the steps of the services, and compare bytes."""
