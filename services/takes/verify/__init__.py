"""`zenocap replay --verify`: the derived messages of a take, recomputed by the same steps and compared byte for byte."""
