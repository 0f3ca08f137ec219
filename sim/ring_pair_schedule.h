// The order in which pairs of rings are worked on in parallel.
#pragma once

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>

namespace twilight {

/// Calls f(a, b) for all pairs a >= b of `rings` rings on the current oneTBB arena, so that no
/// ring is in two calls at once and every ring meets its partners in the same order whatever the
/// number of threads: f may add to the fields of both, and the sums are the same bytes. Blocks of
/// rings meet as in a round-robin tournament (circle method); finished(fraction) is called after
/// every round.
template <class Function, class Progress>
void for_each_ring_pair(std::size_t rings, const Function& f, const Progress& finished) {
  constexpr std::size_t kBlock = 16;  // two blocks of fields fit in the second cache
  const std::size_t blocks = (rings + kBlock - 1) / kBlock;
  const std::size_t players = blocks + blocks % 2;
  const auto meet = [&](std::size_t i, std::size_t j) {
    const std::size_t a_end = std::min(rings, (i + 1) * kBlock);
    const std::size_t b_end = std::min(rings, (j + 1) * kBlock);
    for (std::size_t a = i * kBlock; a < a_end; ++a) {
      for (std::size_t b = j * kBlock; b < (i == j ? a + 1 : b_end); ++b) f(a, b);
    }
  };
  tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t i) { meet(i, i); });
  finished(players > 0 ? 1.0 / static_cast<double>(players) : 1.0);
  for (std::size_t round = 0; round + 1 < players; ++round) {
    tbb::parallel_for(std::size_t{0}, players / 2, [&](std::size_t table) {
      // One player stays, the others move on by one seat each round.
      const std::size_t others = players - 1;
      const std::size_t i = table == 0 ? others : (round + table) % others;
      const std::size_t j = (round + others - table) % others;
      if (std::max(i, j) < blocks) meet(std::max(i, j), std::min(i, j));
    });
    finished(static_cast<double>(round + 2) / static_cast<double>(players));
  }
}

}  // namespace twilight
