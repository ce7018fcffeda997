"""Filter scripts in MeshLab's form that mix our filters with MeshLab's, which run in a process of their own.

Our filters: filters.xml describes them, `steps` does them. MeshLab's own: `catalogue` lists them, `process` runs them.
"""
