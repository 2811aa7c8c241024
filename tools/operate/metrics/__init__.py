"""`zenocap metrics`: figures of one or more rigs for Prometheus, over HTTP."""
