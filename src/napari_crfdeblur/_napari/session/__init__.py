"""One working session on the photos of a viewer, without Qt: its state, and its verbs by topic."""
