"""Readers of files, one format a module. Each gives `Contents`; none fetches anything from outside its folder."""
