// When commands go out: at once when the hands move, again while they hold still, and once more when they have let go.
const REPEAT = 40; // [ms] between two commands while the hands hold still
const SOONEST = 8; // [ms] between two commands while they move, on average
const SAVED = 24;  // [ms] of it that may be used at once: a timer comes only when the page has drawn

// still(): whether the hands ask for no motion; send(): sends the command of now. Returns what is to be called when
// what the hands ask for may have changed.
export function commandRate(still, send) {
  let moving = false, due = -Infinity; // [ms] by performance.now()
  let later = null; // timer of a command for which it was too soon
  const changed = () => {
    const wait = still() ? 0 : due - performance.now();
    clearTimeout(later);
    if (wait > 0) {
      later = setTimeout(changed, wait);
    } else if (!still() || moving) {
      moving = !still();
      due = Math.max(due, performance.now() - SAVED) + SOONEST;
      send();
    }
  };
  setInterval(() => moving && changed(), REPEAT);
  return changed;
}
