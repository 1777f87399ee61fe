"""Work in parts: on all cores or a Dask cluster, kept in a folder so that an interruption costs one part."""
