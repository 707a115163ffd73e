#include "lib/panorama/max_flow.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stx::panorama {

MaxFlow::MaxFlow(int nodes) : nodes_(static_cast<std::size_t>(nodes)) {
    arcs_.reserve(4 * nodes_.size());  // of a grid
}

void MaxFlow::addTerminal(int n, float fromSource, float toSink) {
    node(n).rest += fromSource - toSink;
}

void MaxFlow::addEdge(int a, int b, float capacity, float reverse) {
    const auto at = static_cast<int>(arcs_.size());
    arcs_.push_back({b, node(a).firstArc, capacity});
    arcs_.push_back({a, node(b).firstArc, reverse});
    node(a).firstArc = at;
    node(b).firstArc = at + 1;
}

void MaxFlow::activate(int n) {
    if (node(n).active) return;
    node(n).active = true;
    queue_.push_back(n);
}

int MaxFlow::nextActive() {
    while (queueAt_ < queue_.size()) {
        const int n = queue_[queueAt_++];
        if (queueAt_ > 65536 && queueAt_ * 2 > queue_.size()) {
            queue_.erase(queue_.begin(), queue_.begin() + static_cast<std::ptrdiff_t>(queueAt_));
            queueAt_ = 0;
        }
        node(n).active = false;
        if (node(n).tree != Tree::none) return n;
    }
    return kNone;
}

void MaxFlow::solve() {
    for (int n = 0; n < static_cast<int>(nodes_.size()); ++n) {
        if (node(n).rest == 0) continue;
        node(n).tree = node(n).rest > 0 ? Tree::source : Tree::sink;
        node(n).parent = kTerminal;
        node(n).distance = 1;
        activate(n);
    }
    int current = kNone;
    while (true) {
        int n = current;
        current = kNone;
        if (n == kNone || node(n).tree == Tree::none) n = nextActive();
        if (n == kNone) return;
        int found = kNone;  // an arc from the source's tree to the sink's
        const bool source = node(n).tree == Tree::source;
        for (int a = node(n).firstArc; a != kNone; a = arc(a).next) {
            if ((source ? arc(a).rest : arc(sister(a)).rest) <= 0) continue;
            Node& other = node(arc(a).to);
            if (other.tree == Tree::none) {
                other.tree = node(n).tree;
                other.parent = sister(a);
                other.stamp = node(n).stamp;
                other.distance = node(n).distance + 1;
                activate(arc(a).to);
            } else if (other.tree != node(n).tree) {
                found = source ? a : sister(a);
                break;
            } else if (other.stamp <= node(n).stamp && other.distance > node(n).distance + 1) {
                other.parent = sister(a);
                other.stamp = node(n).stamp;
                other.distance = node(n).distance + 1;
            }
        }
        ++time_;
        if (found == kNone) continue;
        current = n;
        augment(found);
        while (!orphans_.empty()) {
            const int orphan = orphans_.back();
            orphans_.pop_back();
            adopt(orphan);
        }
    }
}

void MaxFlow::augment(int middle) {
    // The most that fits through.
    float most = arc(middle).rest;
    const auto walk = [&](int n, bool toSource, const auto& visit) {
        while (node(n).parent != kTerminal) {
            const int up = node(n).parent;  // the arc from n to its parent
            visit(n, toSource ? sister(up) : up);
            n = arc(up).to;
        }
        return n;
    };
    const auto narrow = [&](int, int a) { most = std::min(most, arc(a).rest); };
    const int start = arc(sister(middle)).to, end = arc(middle).to;
    const int first = walk(start, true, narrow), last = walk(end, false, narrow);
    most = std::min({most, node(first).rest, -node(last).rest});
    arc(middle).rest -= most;
    arc(sister(middle)).rest += most;
    const auto push = [&](int n, int a) {
        arc(a).rest -= most;
        arc(sister(a)).rest += most;
        if (arc(a).rest <= 0) {
            arc(a).rest = 0;
            orphans_.push_back(n);
        }
    };
    walk(start, true, push);
    walk(end, false, push);
    for (const int n : orphans_) node(n).parent = kOrphan;
    node(first).rest -= most;
    node(last).rest += most;
    for (const int n : {first, last}) {
        if (std::abs(node(n).rest) > 1e-6f) continue;
        node(n).rest = 0;
        node(n).parent = kOrphan;
        orphans_.push_back(n);
    }
}

void MaxFlow::adopt(int orphan) {
    const bool source = node(orphan).tree == Tree::source;
    constexpr int kFar = std::numeric_limits<int>::max();
    int best = kNone, bestDistance = kFar;
    for (int a = node(orphan).firstArc; a != kNone; a = arc(a).next) {
        if ((source ? arc(sister(a)).rest : arc(a).rest) <= 0) continue;
        int n = arc(a).to;
        if (node(n).tree != node(orphan).tree || node(n).parent == kNone) continue;
        // Is its origin a terminal?
        int distance = 0;
        while (true) {
            if (node(n).stamp == time_) {
                distance += node(n).distance;
                break;
            }
            const int up = node(n).parent;
            ++distance;
            if (up == kTerminal) {
                node(n).stamp = time_;
                node(n).distance = 1;
                break;
            }
            if (up == kOrphan || up == kNone) {
                distance = kFar;
                break;
            }
            n = arc(up).to;
        }
        if (distance == kFar) continue;
        if (distance < bestDistance) {
            best = a;
            bestDistance = distance;
        }
        for (n = arc(a).to; node(n).stamp != time_; n = arc(node(n).parent).to) {
            node(n).stamp = time_;
            node(n).distance = distance--;
        }
    }
    if (best != kNone) {
        node(orphan).parent = best;
        node(orphan).stamp = time_;
        node(orphan).distance = bestDistance + 1;
        return;
    }
    for (int a = node(orphan).firstArc; a != kNone; a = arc(a).next) {
        const int n = arc(a).to;
        if (node(n).tree != node(orphan).tree) continue;
        if ((source ? arc(sister(a)).rest : arc(a).rest) > 0) activate(n);
        const int up = node(n).parent;
        if (up >= 0 && arc(up).to == orphan) {
            node(n).parent = kOrphan;
            orphans_.push_back(n);
        }
    }
    node(orphan).tree = Tree::none;
    node(orphan).parent = kNone;
}

}  // namespace stx::panorama
