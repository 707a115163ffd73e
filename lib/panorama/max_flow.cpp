#include "lib/panorama/max_flow.hpp"

#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <boost/graph/compressed_sparse_row_graph.hpp>

#include <cstddef>
#include <numeric>
#include <utility>

namespace stx::panorama {

std::vector<bool> MaxFlow::sinkSide() {
    using Graph =
        boost::compressed_sparse_row_graph<boost::directedS, boost::no_property, boost::no_property,
                                           boost::no_property, int, int>;
    using Edge = boost::graph_traits<Graph>::edge_descriptor;
    const auto source = static_cast<int>(surplus_.size()), sink = source + 1;
    for (int n = 0; n < source; ++n) {
        const float surplus = surplus_[n];
        if (surplus > 0) addArcs(source, n, surplus);
        if (surplus < 0) addArcs(n, sink, -surplus);
    }
    // Sorted by the node that they leave, as the graph keeps them.
    std::vector<int> next(surplus_.size() + 2, 0);
    for (const Arc& arc : arcs_) ++next[arc.from];
    std::exclusive_scan(next.begin(), next.end(), next.begin(), 0);
    std::vector<int> places;
    places.reserve(arcs_.size());
    for (const Arc& arc : arcs_) places.push_back(next[arc.from]++);
    std::vector<std::pair<int, int>> ends(arcs_.size());
    std::vector<float> capacity(arcs_.size()), rest(arcs_.size());
    std::vector<Edge> reverse(arcs_.size());
    for (std::size_t i = 0; i < arcs_.size(); ++i) {
        const auto place = static_cast<std::size_t>(places[i]);
        ends[place] = {arcs_[i].from, arcs_[i].to};
        capacity[place] = arcs_[i].capacity;
        reverse[place] = Edge(arcs_[i].to, places[i ^ 1]);
    }
    Graph graph(boost::edges_are_sorted, ends.begin(), ends.end(), sink + 1);
    std::vector<Edge> toParent(surplus_.size() + 2);
    std::vector<int> distance(toParent.size());
    std::vector<boost::default_color_type> tree(toParent.size());
    const auto ofEdge = [&](auto& values) {
        return boost::make_iterator_property_map(values.begin(), get(boost::edge_index, graph));
    };
    const auto nodes = get(boost::vertex_index, graph);
    const auto ofNode = [&](auto& values) {
        return boost::make_iterator_property_map(values.begin(), nodes);
    };
    boost::boykov_kolmogorov_max_flow(graph, ofEdge(capacity), ofEdge(rest), ofEdge(reverse),
                                      ofNode(toParent), ofNode(tree), ofNode(distance), nodes,
                                      source, sink);
    std::vector<bool> found;
    for (std::size_t n = 0; n < surplus_.size(); ++n)
        found.push_back(tree[n] == boost::white_color);
    return found;
}

}  // namespace stx::panorama
