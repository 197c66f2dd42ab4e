"""What all packages share and none owns: files, journal of finished work, progress, command lines."""
