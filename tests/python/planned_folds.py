"""Plans of folds that several tests look at, made once."""

from functools import cache

from withe.folding import Paper, plan

PAPERS = {"a4": Paper.a4, "us_letter": Paper.us_letter, "cardboard": Paper.cardboard}


@cache
def planned(paper, target="half", method="ucs"):
    return plan(PAPERS[paper](), target, method=method)


@cache
def freely(paper, target="half", curvature=2.5):
    return plan(PAPERS[paper](), target, method="slip", grasp="free", curvature=curvature, ending="slow")
