"""Dependencies of zenocap: licences, bill of materials, pinned versions."""
