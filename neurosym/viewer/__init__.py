"""A page to look at: the assembly in 3D, the plan as a film, and what the search knew and did.

`timeline`, `facts`, `solids` and `panels` are pure: they know no server. `session` plans, `page` shows it all with
viser (extra `viewer`), and `export` writes a page that needs neither server nor network.
"""
