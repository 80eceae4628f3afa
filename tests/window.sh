#!/usr/bin/env bash
# Opens the window on a screen of its own, runs the demo by clicks, and saves pictures of what is seen.
#
#     tests/window.sh PROGRAM FOLDER [WIDTHxHEIGHT] [light|dark] [en|sv|de]
#
# Pictures of a merge need target/release/examples/endoscope beside the program (cargo build --release --example endoscope); without it there are none.
# Needs Xvfb, xdotool and ImageMagick's import. Ends with 1 when the window does not come or the demo gives no results.
set -euo pipefail
program="$(realpath "$1")"
folder="$2"
size="${3:-1280x800}"
theme="${4:-light}"
language="${5:-en}"
mkdir -p "$folder"
folder="$(realpath "$folder")"

home="$(mktemp -d)"
# The first screen that nobody uses; a server that does not come up gives way to the next number.
server=""
window=""
cleanup() {
  [ -z "$window" ] || kill "$window" 2>/dev/null || true
  [ -z "$server" ] || kill "$server" 2>/dev/null || true
  rm -rf "$home"
}
trap cleanup EXIT

export HOME="$home" XDG_CONFIG_HOME="$home/config" XDG_DATA_HOME="$home/data"
unset WAYLAND_DISPLAY WAYLAND_SOCKET || true
answers() { xdotool getdisplaygeometry >/dev/null 2>&1; }
number=91
for _ in 1 2 3 4 5; do
  while [ -e "/tmp/.X$number-lock" ]; do number=$((number + 1)); done
  export DISPLAY=":$number"
  Xvfb "$DISPLAY" -screen 0 "${size}x24" +extension GLX >"$home/server" 2>&1 &
  server=$!
  for _ in $(seq 300); do
    if answers || ! kill -0 "$server" 2>/dev/null; then break; fi
    sleep 0.1
  done
  if answers && kill -0 "$server" 2>/dev/null; then break; fi
  kill "$server" 2>/dev/null || true
  number=$((number + 1))
done
if ! answers; then
  echo "no screen could be started" >&2
  cat "$home/server" >&2
  exit 1
fi

width="${size%x*}"
height="${size#*x}"
mkdir -p "$XDG_CONFIG_HOME/shapeline"
printf 'theme = "%s"\nlanguage = "%s"\n[window]\nposition = [0.0, 0.0]\nsize = [%s.0, %s.0]\nmaximized = false\n' \
  "$theme" "$language" "$width" "$height" > "$XDG_CONFIG_HOME/shapeline/window.toml"
"$program" 2> "$home/said" &
window=$!

# Waits until a command succeeds; $1 is what for.
wait_for() {
  local what="$1"
  shift
  for _ in $(seq 300); do
    if ! kill -0 "$window" 2>/dev/null; then
      echo "the window closed while waiting for $what" >&2
      cat "$home/said" >&2
      exit 1
    fi
    "$@" >/dev/null 2>&1 && return
    sleep 0.1
  done
  echo "gave up waiting for $what" >&2
  cat "$home/said" >&2
  exit 1
}

picture() { import -window root "$folder/$1_${size}_${theme}_$language.png"; }
results() { [ "$(find "$home/data/shapeline/demo/results" -name '*.json' | wc -l)" -ge "$1" ]; }

wait_for "the window" xdotool search --name '^Shapeline$'
sleep 2
# No window manager gives it the keyboard.
wait_for "the keyboard" xdotool search --onlyvisible --name '^Shapeline$' windowfocus
picture operator_ready
# The button for the sequence stands in the upper right of wide windows.
if [ "$width" -ge 1600 ]; then xdotool mousemove $((width - 24 - 296)) $((72 + 66 + 66)) sleep 0.2 click 1
elif [ "$width" -ge 1200 ]; then xdotool mousemove $((width - 16 - 210)) $((64 + 56 + 52)) sleep 0.2 click 1
else xdotool key F5; fi
wait_for "the first result" results 1
sleep 0.4
picture operator_running
wait_for "the last result" results 5
sleep 2
picture operator_done
xdotool key ctrl+2
sleep 2
picture results
# Two parts back, the first point out of tolerance: why it is one, its section, its trend.
xdotool key Prior sleep 0.5 key Prior sleep 3 key n
sleep 3
picture results_point
# The engineer's password is set by typing it twice, then the plan is open.
xdotool key ctrl+3
sleep 1
picture engineer_locked
xdotool type --delay 30 "blech und rand"
xdotool key Tab sleep 0.3
xdotool type --delay 30 "blech und rand"
xdotool key Return
password() { grep -q '^engineer_password = "\$argon2id' "$XDG_CONFIG_HOME/shapeline/window.toml"; }
wait_for "the password" password
sleep 4
picture engineer
if [ "$width" -ge 1600 ]; then
  # A new point on the trimmed edge, proposed by a click.
  xdotool mousemove 1058 606 key e sleep 0.5 click 1
  sleep 3
  picture engineer_draft
  xdotool key Escape sleep 0.2 key Escape
  # A new plan from the menu of the third button from the right: its first field has the focus, Next stands in the lower right.
  next() { xdotool mousemove $((width - 98)) $((height - 60)) sleep 0.2 click 1 sleep 1; }
  xdotool mousemove $((width - 245)) 36 sleep 0.2 click 1 sleep 1
  xdotool mousemove $((width - 245)) 142 sleep 0.2 click 1 sleep 1
  picture new_plan_1
  xdotool type --delay 10 "$home/data/shapeline/demo/bracket.stl"
  xdotool key Return
  sleep 3
  next
  xdotool type --delay 10 "$home/data/shapeline/demo/scans/01_good_top.ply"
  xdotool key Return
  sleep 6
  picture new_plan_2
  next
  # How thick, and on which side: the first of the three.
  xdotool type "1.2"
  xdotool key Tab sleep 0.3 key space sleep 1
  picture new_plan_3
  next
  sleep 3
  # One point on the part, beside its holes.
  xdotool key s sleep 0.3 mousemove $((width / 2 - 290)) 460 sleep 0.5 click 1
  sleep 1
  picture new_plan_4
  xdotool key Return sleep 2
  next
  picture new_plan_5
fi
xdotool key ctrl+1 sleep 0.3 key F1
sleep 1
picture help
xdotool key Escape
# Help is the last button of the bar, View the one before it.
xdotool mousemove $((width - 142)) 32 sleep 0.2 click 1
sleep 1
picture view_menu

# A merge: six views of a pin and one of something else.
endoscope="$(dirname "$program")/examples/endoscope"
if [ ! -x "$endoscope" ]; then
  echo "no pictures of a merge: $endoscope is not built" >&2
  exit 0
fi
kill "$window"
wait "$window" 2>/dev/null || true
"$endoscope" "$home/pin" pin >/dev/null
"$program" "$home/pin/merge.toml" 2> "$home/said" &
window=$!
wait_for "the window of the merge" xdotool search --name '^Shapeline$'
sleep 2
wait_for "the keyboard" xdotool search --onlyvisible --name '^Shapeline$' windowfocus
sleep 18
picture merge
xdotool key F5
sleep 1.2
picture merge_running
wait_for "the merged cloud" test -e "$home/pin/merge.json"
sleep 4
picture merge_done
# The first view by itself, its row being the first of the list.
if [ "$width" -ge 1200 ]; then xdotool mousemove 120 $((64 + 52 + 38 + 36 + 14 + (width >= 1600 ? 8 : 0))) sleep 0.2 click 1
else xdotool mousemove 120 240 sleep 0.2 click 1
fi
sleep 3
picture merge_view
