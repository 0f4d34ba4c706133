"""The study: every acceleration method over many scenes on the same rays, measured, compared and told in a report.

`task.Study` measures what a `plan.Plan` asks for, in a daemon thread, and keeps every measurement in a journal as it
goes, so that it goes on where it stopped; `results` makes rows of the journal, and `outputs` writes them down.
Nothing in this package imports bpy: what only Blender can open, it is given as arrays (see `sources`).
"""
