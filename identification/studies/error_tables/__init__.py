"""What the printed error tables of the real valve say about the causes of its gap."""
