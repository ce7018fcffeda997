"""Filter scripts in MeshLab's form that mix our filters with MeshLab's, which run in a process of their own.

Our filters: filters.xml describes them, `own_filters` does them. MeshLab's own: `pymeshlab_filters` lists them,
`process` runs them.
"""
