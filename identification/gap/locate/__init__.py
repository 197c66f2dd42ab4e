"""Where the gap lies: channel, regime and state equation."""
