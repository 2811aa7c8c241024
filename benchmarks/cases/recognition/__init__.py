"""Recognition of postures: simulated people, real motion, streams, rates of false postures, costs."""
