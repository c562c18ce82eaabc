"""Work spread over threads, processes, executors and shards, and kept so that it can go on after an interrupt."""
