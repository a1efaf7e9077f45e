// Who moves the robot now, and what a stick would do: from what the robot itself reports. Knows no page and no clock.
const LIVE = ["can_drive", "can_stop", "can_take_it", "can_mix"];
const IMMOVABLE = ["port_missing", "port_taken", "port_forbidden", "board_silent", "board_unknown"]; // faults

// open: whether there is a connection; stalled: whether it is silent; state, status: newest, or null; page: own number.
// {who: [key of a text, name], can: key of a text, live: whether a stick moves the robot}
export function truth({open, stalled, state, status, page}) {
  if (!open || !state) {
    return {who: ["lost", ""], can: "can_nothing", live: false};
  }
  const can = whatAStickDoes(stalled, state, status, page);
  return {who: state.stopped ? ["stopped", ""] : whoMoves(state, page), can, live: LIVE.includes(can)};
}

function whoMoves({mover: [kind, name], driver}, page) {
  switch (kind) {
    case "page":
      return [driver === page ? "who_you" : "who_other", ""];
    case "hand":
      return /keyboard/.test(name) ? ["who_keys", ""] : /joy/.test(name) ? ["who_gamepad", ""] : ["who_hand", name];
    case "navigation":
      return ["who_navigation", ""];
    case "nobody":
      return [driver === null ? "who_nobody" : driver === page ? "who_yours" : "who_others", ""];
    default:
      return [`who_${kind}`, name];
  }
}

function whatAStickDoes(stalled, state, status, page) {
  const immovable = status?.lights.some((light) => light.level === 2 && IMMOVABLE.includes(light.key));
  const program = state.driven_by === "default" ? "can_take_it" : "can_mix";
  const found = [
    [stalled, "can_wait"],
    [state.stopped, "can_release"],
    [state.driver !== null && state.driver !== page, "can_take_over"],
    [!state.heard, "can_no_mux"],
    [immovable, "can_no_board"],
    [state.held.includes(page), "can_let_go"],
    [true, {page: "can_stop", navigation: "can_take_it", program}[state.mover[0]] ?? "can_drive"],
  ];
  return found.find(([is]) => is)[1];
}

// The light that a person should look at, or null; `told`: names of tasks whose fault the page shows already
export function worst(lights, told) {
  return byWorst(lights.filter((light) => light.level > 0 && !told.test(light.name)))[0] ?? null;
}

// Lights, the worst first: an error, silence, a warning
export function byWorst(lights) {
  const rank = [0, 1, 3, 2];
  return [...lights].sort((one, other) => (rank[other.level] ?? 3) - (rank[one.level] ?? 3));
}
