"""Times, rates, latencies and memory: what depends on the machine."""
