"""The HTML report: its page, and the tables and figures that several stages show."""
