#pragma once

#include <array>

#include "transitions/project/counts.hpp"

namespace edgewise {

// The groupings of [W93] Appendix B: samples that lie behind one another are composited two by two,
// in an order of their own, and what lies in front stays in front. Over is associative (Lemma 4.1),
// so all give the same light up to rounding; it is not commutative (Lemma 4.2).
//
// An algebra says what a part of a ray is and how parts join. Light and transparency are its own:
// edges join rows of pixels, tests count what a single ray takes.
//
//   using Part = ...;
//   Part leaf(int i);                                    sample i; 0 lies in front
//   Part over(Part front, Part behind, bool updates);    EQ 86, and EQ 87 where updates
//   Part attenuated(const Part& front, int i, bool updates);
//                                                        sample i through all that lies in front of
//                                                        it, whose transparency `front` has
//   Part sum(Part front, Part behind);                   light of both, transparency of the second
//
// Without updates nobody asks for the transparency of the result: nothing lies behind it.

/// Composites samples [begin, end) of a ray of `samples`, at least one.
template <class Algebra>
class Grouping {
 public:
    using Part = typename Algebra::Part;

    Grouping(Algebra& algebra, int samples) : algebra_(algebra), samples_(samples) {}

    Part composite(Compositing how, int begin, int end) {
        switch (how) {
            case Compositing::back_to_front:
                return back_to_front(begin, end);
            case Compositing::front_to_back:
                return front_to_back(begin, end);
            case Compositing::tree_from_back:
                return tree_from_back(begin, end);
            case Compositing::tree_from_front:
                return tree_from_front(begin, end);
            case Compositing::sum:
                break;
        }
        return attenuated_sum(begin, end);
    }

 private:
    /// A full tree whose neighbour is still to come. Sizes halve at least from one to the next: as
    /// many as an int has bits will do.
    struct Tree {
        Part part;
        int samples, end;
    };
    struct Waiting {
        std::array<Tree, 32> trees;
        int count = 0;

        Tree& last() { return trees[static_cast<std::size_t>(count - 1)]; }
        Tree& before() { return trees[static_cast<std::size_t>(count - 2)]; }
        bool alike() { return count > 1 && before().samples == last().samples; }
        void push(Tree tree) { trees[static_cast<std::size_t>(count++)] = tree; }
        template <class Join>
        void join(const Join& how) {
            before() = how(before(), last());
            --count;
        }
        /// Trees of one size, so that all that wait are full.
        template <class Join>
        void join_alike(const Join& how) {
            while (alike()) join(how);
        }
        /// At the end, whatever their size.
        template <class Join>
        void join_all(const Join& how) {
            while (count > 1) join(how);
        }
    };

    bool updates(int end) const { return end != samples_; }

    Part back_to_front(int begin, int end) {
        Part behind = algebra_.leaf(end - 1);
        for (int i = end - 2; i >= begin; --i)
            behind = algebra_.over(algebra_.leaf(i), behind, updates(end));
        return behind;
    }

    Part front_to_back(int begin, int end) {
        Part front = algebra_.leaf(begin);
        for (int i = begin + 1; i < end; ++i)
            front = algebra_.over(front, algebra_.leaf(i), updates(i + 1));
        return front;
    }

    /// Neighbours are paired from the back: what is left over lies in front.
    Part tree_from_back(int begin, int end) {
        const auto over = [this](Tree& behind, Tree& front) {
            return Tree{algebra_.over(front.part, behind.part, updates(behind.end)),
                        front.samples + behind.samples, behind.end};
        };
        Waiting waiting;
        for (int i = end - 1; i >= begin; --i) {
            waiting.push({algebra_.leaf(i), 1, i + 1});
            waiting.join_alike(over);
        }
        waiting.join_all(over);
        return waiting.last().part;
    }

    /// Neighbours are paired from the front: what is left over lies behind.
    Part tree_from_front(int begin, int end) {
        const auto over = [this](Tree& front, Tree& behind) {
            return Tree{algebra_.over(front.part, behind.part, updates(behind.end)),
                        front.samples + behind.samples, behind.end};
        };
        Waiting waiting;
        for (int i = begin; i < end; ++i) {
            waiting.push({algebra_.leaf(i), 1, i + 1});
            waiting.join_alike(over);
        }
        waiting.join_all(over);
        return waiting.last().part;
    }

    /// Transparencies are multiplied one after another, light is added in a tree.
    Part attenuated_sum(int begin, int end) {
        const auto sum = [this](Tree& front, Tree& behind) {
            return Tree{algebra_.sum(front.part, behind.part), front.samples + behind.samples,
                        behind.end};
        };
        Waiting waiting;
        waiting.push({algebra_.leaf(begin), 1, begin + 1});
        for (int i = begin + 1; i < end; ++i) {
            waiting.push({algebra_.attenuated(waiting.last().part, i, updates(i + 1)), 1, i + 1});
            waiting.join_alike(sum);
        }
        waiting.join_all(sum);
        return waiting.last().part;
    }

    Algebra& algebra_;
    int samples_;
};

}  // namespace edgewise
