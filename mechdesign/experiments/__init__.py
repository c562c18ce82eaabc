"""Whole studies as a design of experiments: cases of a study, answered one by one."""
