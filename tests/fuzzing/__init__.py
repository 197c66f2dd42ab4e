"""Wrong inputs by the thousand: each file format and command line has to refuse them in a sentence."""
