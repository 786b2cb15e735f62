"""Tables from recordings: CSV, Parquet, BIDS and Vowpal Wabbit."""
