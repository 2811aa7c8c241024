"""`zenocap certs`: the certificate authority of a rig, and a certificate for each of its members."""
