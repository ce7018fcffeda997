"""Filter scripts in MeshLab's form that mix our filters with MeshLab's, which run in a process of their own."""
