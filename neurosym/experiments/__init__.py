"""Everything that makes tables for the paper. Comparisons of planners and priors: `benchmark`, `reporting`; Table II:
`reproduce`; orders read from pictures: `studies`, `imitation`; all on one page: `results_page`.
"""
