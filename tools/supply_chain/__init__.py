"""What zenocap is made of: run-time dependencies, their licences, a bill of materials, and pinned versions with hashes."""
