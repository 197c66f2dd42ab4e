"""The blind check: causes are drawn and committed to, the campaigns diagnosed blind, then scored."""
