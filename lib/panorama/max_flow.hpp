#pragma once

#include <vector>

namespace stx::panorama {

/// The least cut of a graph between a source and a sink (Boykov and Kolmogorov 2004, by Boost).
/// Deterministic.
class MaxFlow {
  public:
    explicit MaxFlow(int nodes) : surplus_(static_cast<std::size_t>(nodes), 0.0f) {}
    /// Adds capacities from the source to a node, and from it to the sink.
    void addTerminal(int node, float fromSource, float toSink) {
        surplus_[node] += fromSource - toSink;
    }
    /// Adds a capacity from one node to another. Not negative.
    void addEdge(int from, int to, float capacity) { addArcs(from, to, capacity); }
    /// Finds the least cut: for each node, whether it must be on the sink's side.
    [[nodiscard]] std::vector<bool> sinkSide();

  private:
    struct Arc {
        int from, to;
        float capacity;
    };
    void addArcs(int from, int to, float capacity) {
        arcs_.push_back({from, to, capacity});
        arcs_.push_back({to, from, 0});
    }

    std::vector<float> surplus_;  ///< of each node: from the source, less what goes to the sink
    std::vector<Arc> arcs_;       ///< behind each the one in the other direction
};

}  // namespace stx::panorama
