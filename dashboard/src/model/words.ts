// What states and verdicts mean to people.

export interface StateWords {
  name: string;
  color: string;
  /** What to do about it; empty when nothing is to be done. */
  advice: string;
}

export const kStates: StateWords[] = [
  {
    name: "Initializing",
    color: "--violet",
    advice: "Point the cameras at something textured and move gently sideways.",
  },
  { name: "Tracking", color: "--teal", advice: "" },
  {
    name: "Scale not observed",
    color: "--amber",
    advice: "Bring near texture into both views; the shape is good, lengths may drift.",
  },
  {
    name: "Degraded",
    color: "--orange",
    advice: "Slow down; check light, focus and dirt on the glass.",
  },
  {
    name: "Lost",
    color: "--red",
    advice: "Go back to where it was tracking, slowly; a new segment begins by itself.",
  },
  { name: "Resetting", color: "--violet", advice: "" },
  { name: "Stopped", color: "--grey", advice: "Resume with the command button or sovo command resume." },
];

export function stateWords(state: number): StateWords {
  return kStates[state] ?? { name: `State ${state}`, color: "--grey", advice: "" };
}

export const kVerdicts = [
  "accepted",
  "too few points",
  "not observable",
  "ambiguous",
  "too few inliers",
  "out of range",
  "innovation too large",
  "no right image",
];

export const kLevels = ["OK", "Warning", "Error", "Stale"];
export const kLevelColors = ["--teal", "--amber", "--red", "--grey"];

/** What to do about a line of /diagnostics, by what it says. */
export function healthAdvice(level: number, message: string): string {
  if (level === 0) return "";
  const text = message.toLowerCase();
  const rules: [string, string][] = [
    ["no frame", "Check that the camera process runs and its cable is in: sovo doctor."],
    ["frames come", "Check that the camera process runs and its cable is in: sovo doctor."],
    ["missing", "One camera does not deliver: check its cable and power."],
    ["were lost", "Lower rate or size, or give the camera a bus of its own."],
    ["lost", "Go back to where it was tracking, slowly."],
    ["scale", "Bring near texture into both views."],
    ["disk", "Free space, or record to another disk."],
    ["initial", "Point the cameras at texture and move sideways."],
    ["degraded", "Slow down; check light, focus and dirt on the glass."],
  ];
  return rules.find(([key]) => text.includes(key))?.[1] ?? "See the process' log.";
}
