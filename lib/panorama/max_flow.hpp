#pragma once

#include <cstdint>
#include <vector>

namespace stx::panorama {

/// The least cut of a graph between a source and a sink (Boykov and Kolmogorov 2004: two trees that
/// grow towards each other and are repaired after each path). Deterministic.
class MaxFlow {
  public:
    explicit MaxFlow(int nodes);
    /// Adds capacities from the source to a node, and from it to the sink.
    void addTerminal(int node, float fromSource, float toSink);
    /// Adds capacities of both directions between two nodes. Not negative.
    void addEdge(int a, int b, float capacity, float reverse);
    /// Finds the least cut.
    void solve();
    /// After solve(): the node must be on the sink's side.
    [[nodiscard]] bool onSinkSide(int node) const {
        return nodes_[static_cast<std::size_t>(node)].tree == Tree::sink;
    }

  private:
    enum class Tree : std::uint8_t { none, source, sink };
    static constexpr int kNone = -1, kTerminal = -2, kOrphan = -3;
    struct Node {
        int firstArc = kNone;
        int parent = kNone;  ///< arc to it, or one of the above
        float rest = 0;      ///< > 0: left from the source; < 0: left to the sink
        Tree tree = Tree::none;
        bool active = false;
        int stamp = 0, distance = 0;
    };
    struct Arc {
        int to, next;
        float rest;
    };
    static int sister(int arc) { return arc ^ 1; }
    Node& node(int n) { return nodes_[static_cast<std::size_t>(n)]; }
    Arc& arc(int a) { return arcs_[static_cast<std::size_t>(a)]; }
    void activate(int n);
    [[nodiscard]] int nextActive();
    void augment(int middle);
    void adopt(int orphan);

    std::vector<Node> nodes_;
    std::vector<Arc> arcs_;
    std::vector<int> queue_, orphans_;
    std::size_t queueAt_ = 0;
    int time_ = 0;
};

}  // namespace stx::panorama
