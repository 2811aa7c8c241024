"""`zenocap load`: measure latency, loss and cost with many viewers, rigs and subscribers, up to the limit of the load."""
