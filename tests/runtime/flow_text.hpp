#pragma once

#include <algorithm>
#include <gtest/gtest.h>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "runtime/runtime.hpp"

namespace edgewise::toys {

/// What the text of a drawing says (flow_dot), checked: each name once, arcs between names alone.
struct FlowText {
    std::set<std::string> nodes, data;     // rectangles and ellipses
    std::set<std::string> started, ended;  // nodes that arcs lead to and from
    int arcs = 0, boxes = 0;               // boxes: dashed frames
    int inside = 0;                        // arcs between two nodes: in a box

    explicit FlowText(const std::string& dot) {
        EXPECT_TRUE(dot.starts_with("digraph flow {"));
        EXPECT_EQ(std::count(dot.begin(), dot.end(), '{'), std::count(dot.begin(), dot.end(), '}'));
        each(dot, R"(\n +(t\d+r\d+s\d+) \[label=)",
             [&](const std::smatch& found) { EXPECT_TRUE(nodes.insert(found[1]).second); });
        each(dot, R"(\n +(d\d+|source) \[shape=ellipse)",
             [&](const std::smatch& found) { EXPECT_TRUE(data.insert(found[1]).second); });
        each(dot, R"(style=dashed)", [&](const std::smatch&) { ++boxes; });
        each(dot, R"(\n +(\w+) -> (\w+)[; ])", [&](const std::smatch& arc) {
            ++arcs;
            for (int end : {1, 2})
                EXPECT_TRUE(nodes.contains(arc[end]) || data.contains(arc[end])) << arc[end];
            if (nodes.contains(arc[1])) ended.insert(arc[1]);
            if (nodes.contains(arc[2])) started.insert(arc[2]);
            inside += nodes.contains(arc[1]) && nodes.contains(arc[2]);
        });
    }

    /// How many nodes each step has.
    std::map<int, int> by_step() const {
        std::map<int, int> count;
        for (const std::string& node : nodes) ++count[std::stoi(node.substr(node.rfind('s') + 1))];
        return count;
    }
    static std::map<int, int> by_step(const std::vector<Ran>& trace) {
        std::map<int, int> count;
        for (const Ran& ran : trace) ++count[ran.step];
        return count;
    }

 private:
    template <class Body>
    static void each(const std::string& text, const char* pattern, Body body) {
        const std::regex regex(pattern);
        for (auto it = std::sregex_iterator(text.begin(), text.end(), regex);
             it != std::sregex_iterator(); ++it)
            body(*it);
    }
};

}  // namespace edgewise::toys
