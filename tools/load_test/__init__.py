"""`zenocap load`: latency, loss and cost up to the limit of the load."""
