"""`zenocap verify`: derived messages recomputed and compared byte for byte."""
