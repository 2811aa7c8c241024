"""`zenocap warmup`: compilation of the services' kernels before their start."""
