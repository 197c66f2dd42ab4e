"""The console command `epv`."""
