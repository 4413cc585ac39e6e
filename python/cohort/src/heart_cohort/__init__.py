"""Shards of heart-phantom cohorts on engines written in Python."""
