"""Is the data good enough to identify from (section 4)?"""
