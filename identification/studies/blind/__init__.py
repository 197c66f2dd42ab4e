"""The blind check: campaigns whose cause is drawn and sealed, diagnosed unseen, then scored."""
