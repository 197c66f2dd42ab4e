"""What the 2003 report defines and prints: test cases, output error, printed tables."""
