"""From examples of postures to their models, and to when a posture is none of them."""

from collections.abc import Sequence

from services.recognizer.examples import Example as Example
from services.recognizer.examples import ExampleError as ExampleError
from services.recognizer.examples import Plan as Plan
from services.recognizer.examples import prepared
from services.recognizer.fitting import Report, fitted
from services.recognizer.model import PostureModel
from services.recognizer.thresholds import with_thresholds


def train(examples: Sequence[Example], plan: Plan, report: Report = lambda done, of, words: None) -> PostureModel:
    """One model for each label of the examples, with thresholds.

    The same examples and plan give the same numbers.  report: is told how many models are done, of how many, and what
    is being learnt.  Raises ExampleError.
    """
    ready = prepared(examples, plan)
    model = fitted(ready, plan, report)
    return with_thresholds(model, ready, plan, report) if plan.folds else model
