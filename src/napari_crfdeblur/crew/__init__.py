"""What long work shares: who does it, that it is alone, and that its files stay as they were."""
