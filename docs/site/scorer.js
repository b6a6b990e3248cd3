/* Pages for users come first, behind them the reference and pages for developers: a word such as "contact" is also the name of a
 * module and a class. Who types a name that is no plain word, as GeneralizedAlpha or follow_path, wants what has it. */
const NAMED = /[a-z0-9][A-Z]|[_.]/.test(new URLSearchParams(location.search).get("q") ?? "");

var Scorer = {
  score: ([page, title, anchor, description, score]) => {
    if (score >= Scorer.objNameMatch) return NAMED ? score : score - Scorer.objNameMatch - Scorer.behind;
    return /^(api\/|architecture$|CONTRIBUTING$)/.test(page) ? score - Scorer.behind : score;
  },
  objNameMatch: 1000,
  behind: 100,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
