#pragma once

// Gives equal keys one index, counted from 0 in the order of appearance: an open
// hash table with linear probing. Keys are arrays of 32 bits.

#include <array>
#include <cstdint>
#include <vector>

#include "wisp/core/rng.h"

namespace wisp {

struct weld_table {
  using key_type = std::array<uint32_t, 3>;
  std::vector<int> slots = std::vector<int>(1024, -1);
  std::vector<key_type> keys = {};  // by index
};

// The slot that holds the key, or the empty one where it belongs.
inline std::size_t weld_slot(const weld_table& table, const weld_table::key_type& key) {
  const std::size_t mask = table.slots.size() - 1;
  const uint32_t hash = hash_combine(hash_combine(hash32(key[0]), key[1]), key[2]);
  std::size_t slot = hash & mask;
  while (table.slots[slot] >= 0 && table.keys[static_cast<std::size_t>(table.slots[slot])] != key) {
    slot = (slot + 1) & mask;
  }
  return slot;
}

inline int weld(weld_table& table, const weld_table::key_type& key) {
  std::size_t slot = weld_slot(table, key);
  if (table.slots[slot] >= 0) return table.slots[slot];
  if (table.keys.size() * 2 >= table.slots.size()) {
    table.slots.assign(table.slots.size() * 2, -1);
    for (std::size_t k = 0; k < table.keys.size(); ++k) {
      table.slots[weld_slot(table, table.keys[k])] = static_cast<int>(k);
    }
    slot = weld_slot(table, key);
  }
  table.slots[slot] = static_cast<int>(table.keys.size());
  table.keys.push_back(key);
  return table.slots[slot];
}

}  // namespace wisp
