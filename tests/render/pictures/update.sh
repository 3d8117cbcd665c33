#!/usr/bin/env bash
# Renders the references of test_pictures.cpp anew: update.sh WISP [NAME...]
# Only after a change that is meant to change pictures; look at them before you commit.
set -euo pipefail
wisp=$1
shift
here=$(cd "$(dirname "$0")" && pwd)
for name in ${@:-materials hair-ball}; do
  scene=$here/$name.json
  [ -f "$scene" ] || scene=$here/../../../scenes/$name.json
  "$wisp" render "$scene" -o "$here/$name.exr" --resolution 48 --samples 4096 --seed 1000 \
    --filter box --bounces 64 --aovs error
done
