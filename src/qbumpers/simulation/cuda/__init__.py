"""Trials of tabular learners on a graphics card, a thread each, by the loops of the processor.

`devices` says which card, and why there is none; `layout` where arrays lie; `kernel` is what runs
on a card, and `device_code` what its compiler needs for that; `engine` simulates.
"""
