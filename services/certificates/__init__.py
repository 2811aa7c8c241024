"""`zenocap certs`: the small authority of a rig, and a certificate for each of its members."""
