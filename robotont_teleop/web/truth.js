// Who moves the robot now, and what a stick may do: from what the robot itself reports. Knows no page and no clock.
const LIVE = ["can_drive", "can_stop", "can_take_it", "can_mix", "can_try"];
const IMMOVABLE = ["port_missing", "port_taken", "port_forbidden", "board_silent", "board_unknown"]; // faults

// open: whether there is a connection; stalled: whether it is silent; state, status: newest, or null; page: own number.
// {who: [key of a text, name], can: key of a text, live: whether a stick may move the robot}
export function truth({open, stalled, state, status, page}) {
  if (!open || !state) {
    return {who: ["lost", ""], can: "can_nothing", live: false};
  }
  const can = whatAStickDoes(stalled, state, status, page);
  const stands = state.stopped && !state.stop_waits; // a stop that waits has not reached it yet
  return {who: stands ? ["stopped", ""] : whoMoves(state, page), can, live: LIVE.includes(can)};
}

function whoMoves({mover: [kind, name], driver}, page) {
  const mine = driver === page;
  return {
    page: [mine ? "who_you" : "who_other", ""],
    hand: /keyboard/.test(name) ? ["who_keys", ""] : /joy/.test(name) ? ["who_gamepad", ""] : ["who_hand", name],
    navigation: ["who_navigation", ""],
    program: ["who_program", name],
    nobody: [driver === null ? "who_nobody" : mine ? "who_yours" : "who_others", ""],
  }[kind];
}

function whatAStickDoes(stalled, state, status, page) {
  const links = status?.lights.filter(({name}) => name.endsWith("link")) ?? []; // of a node that was replaced, too
  const immovable = (links.length > 0 && links.every(({level}) => level === 3)) || status?.lights.some(
    ({level, key}) => level === 2 && IMMOVABLE.includes(key));
  const doubtful = links.some(({level, key}) => level === 2 || (level === 1 && key.startsWith("board_")));
  const noDriver = status?.lights.some(({key}) => key === "no_driver"); // another one may have the board
  const barred = status?.lights.some(({key}) => key === "barred"); // who moves may be held behind a STOP: no mover
  const program = state.driven_by === "default" ? "can_take_it" : "can_mix";
  const found = [
    [stalled, "can_wait"],
    [state.stopped, "can_release"],
    [state.driver !== null && state.driver !== page, "can_take_over"],
    [!state.driven_by, "can_no_mux"],
    [noDriver, "can_nothing"],
    [immovable, "can_no_board"],
    [state.held.includes(page), "can_let_go"],
    [true, {page: "can_stop", hand: barred ? null : "can_hand_first", navigation: "can_take_it", program}[state.mover[0]] ??
      (doubtful ? "can_try" : "can_drive")],
  ];
  return found.find(([is]) => is)[1];
}
