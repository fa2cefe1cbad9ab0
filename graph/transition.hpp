#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "graph/cost.hpp"
#include "graph/data.hpp"
#include "graph/errors.hpp"
#include "graph/joins.hpp"
#include "graph/parameters.hpp"
#include "graph/request.hpp"
#include "graph/scene.hpp"
#include "graph/trial.hpp"

namespace edgewise {

class Model;  // scene/model.hpp
struct ModelSetting;

/// What an edge is asked about: all five answers see both.
struct Ask {
    const Request& want;
    const Scene& scene;
};

/// Where an edge leads from a representation, or why it does not apply.
struct Offer {
    Representation from = {}, to = {};
    Parameters with = {};
    std::string refused = {};  // the reason (Message), with the number that broke the limit

    static Offer no(const Message& reason) { return {.refused = reason.marked()}; }
};

/// How a step may be cut into regions.
struct Partition {
    /// whole: not at all (it threads itself inside); output: each region of the output is computed
    /// alone; input: each region of the input gives a part, and parts are merged.
    enum Kind { whole, output, input } kind = whole;
    /// Least extent of a region; regions are cut from extents alone, never from threads or memory.
    Extent leaf = {};
    /// output: the box of the input that a region of the output needs, halo included. A run on that
    /// region reads no other sample, so that the input may hold that box alone (Data::box). Absent:
    /// all of it.
    std::function<Region(const Region& out, int view)> reads = {};
    /// input: joins the part of a later region to that of an earlier one; associative.
    std::function<void(Data& into, const Data& from)> merge = {};
};

/// What a running step may use.
struct Context {
    std::pmr::memory_resource* memory = nullptr;  // the only source of scratch
    const std::atomic<bool>* stop = nullptr;      // set by the user: return soon, by Cancelled
    const std::atomic<bool>* failed = nullptr;    // set by a node that failed: likewise
    int view = 0;                                 // which view's output is made

    bool stopped() const noexcept {
        return (stop && stop->load(std::memory_order_relaxed)) ||
               (failed && failed->load(std::memory_order_relaxed));
    }
    /// Called once a row or tile. @throws Cancelled
    void poll() const {
        if (stopped()) throw Cancelled();
    }
};

/// What an edge keeps, and property tests sweep.
enum class Law {
    identity,      // no geometry: the samples themselves
    constant,      // a constant stays constant
    linear,        // a sum of inputs gives the sum of outputs
    whole_shift,   // a shift by whole samples is a copy
    quarter_turn,  // four quarter turns give the input back
    bijection,     // every sample of the input is sent to exactly one place
};

/// Adds facts to a scene (Scene::facts): what it counts of the data for a request.
using CountFacts = void (*)(const Data& input, const Request&, std::map<std::string, double>& facts,
                            std::pmr::memory_resource*);

/// An edge: a name, what it declares, and five answers. A value: no base class, no registration.
struct Transition {
    std::string name = {};    // "family.edge"
    std::string source = {};  // where algorithm and counts come from
    /// What its numbers depend on beside its code and all that it declares here: tables that it was
    /// made with, say. Facts that were kept for another version are not used.
    std::string version = {};
    /// Kinds that it goes between ("object/scalar", "object/scalar+minmax"), without a request. The
    /// planner asks for an offer only where the first fits: data may have more facets, of which the
    /// edge then sees nothing.
    std::vector<std::pair<std::string, std::string>> joins = {};
    std::map<std::string, Domain> parameters = {};
    std::vector<Law> laws = {};
    /// Its output is its input with an addition, whose bytes it adds to facet_bytes: one facet more
    /// (Representation::facets), or another content, where no other edge has a use
    /// for it. The output shares samples and facets with the input; `run` puts what is new into
    /// Data::facets or Data::other and writes no sample.
    bool attaches = false;
    /// Whether views may be transforms that no matrix is. Others are not asked about such a
    /// request.
    bool any_transform = false;
    /// Asked about only where a demand names it (`--via`): what other edges always do for less
    /// would multiply the paths of every request and be on none that is taken.
    bool on_demand = false;
    /// With these, and with a filter as its only other parameter, the edge alone is the plain path
    /// to the screen, which budgets may compare with (Budget::like).
    std::optional<Parameters> plain = {};

    /// Where it leads, or why not. Cheap: decide before copying.
    std::function<Offer(const Representation& from, const Ask&, const Parameters& with)> offer = {};
    /// One run, one view.
    std::function<Work(const Offer&, const Ask&, int view)> work = {};
    /// What it adds, and how what came before passes. Absent: it is measured by running the edge
    /// on the request, or on drawn parts of it (error_of).
    std::function<Error(const Offer&, const Ask&)> error = {};
    /// Adds what its counts ask of the data to the facts of a scene. Absent: the statistics do.
    std::function<void(const Data& input, const Request&, std::map<std::string, double>& facts,
                       std::pmr::memory_resource*)>
        count = {};
    /// The same of facts that several edges read. Each names the function that counts them, so that
    /// a catalogue with any of these edges has the facts; a scene calls each function once.
    std::vector<CountFacts> shared_counts = {};
    /// How single output samples of it are worked out in f64, so that a preview can measure its
    /// errors; null where it has nothing to say of a request. Absent: `error` needs no facts, or is
    /// measured.
    std::function<std::shared_ptr<const Model>(const ModelSetting&)> model = {};
    /// Of a model whose facts follow from others: adds to facts that are wanted those that they are
    /// derived from.
    std::function<void(std::set<std::string>& wanted)> derives = {};
    std::function<Partition(const Offer&, const Ask&)> parts = [](const Offer&, const Ask&) {
        return Partition{};
    };
    /// Writes one region of `out` (Partition::output), or all of it from one region of `in`
    /// (Partition::input), or all (Partition::whole; the region is then the output's extent).
    /// The samples of out are allocated, not initialised. @throws Cancelled, std::bad_alloc,
    /// RunError
    std::function<void(const Offer&, const Ask&, const Data& in, Data& out, const Region&,
                       Context&)>
        run = {};

    /// Requests that `edgewise calibrate` times it on. Absent: it is timed where the trials of
    /// other edges pass it.
    std::function<std::vector<Trial>()> trials = {};
    /// Measured over counted seconds of its loops on the built-in machine, where its counts miss
    /// something: by parameters and variant as timing_name() writes them behind the edge's name
    /// ("/filter=foh"), "" of all others. The longest that fits counts; absent: 1.
    std::map<std::string, double> factors = {};

    std::string family() const { return name.substr(0, name.find('.')); }
    /// Why it cannot be asked about a request's views; empty: it can.
    std::string views_refused(const Request& want) const;
    /// `error`; of an edge without one what running it gave, or unknown.
    Error error_of(const Offer& offer, const Ask& ask) const;
};

/// The error of an edge that adds none.
Error exact(const Offer& offer, const Ask& ask);
/// The fact that tells what running an edge gave.
FactName fact_of_runs(const Transition& edge, const Parameters& with);
FactName fact_of_runs(const std::string& edge, const Parameters& with);
/// The same where samples were first made another type: the error is that of both steps.
FactName fact_of_runs(const std::string& edge, const Parameters& with, Type made);
/// The fact that holds, for the same runs, the gain of errors of the input.
FactName gain_of_runs(const FactName& fact_of_runs);
/// Whether a fact was measured by making results: of runs, of the results, of writing them.
bool is_of_results(std::string_view fact);

/// Regions of a step; cut from extents and leaf alone, so that bytes never depend on threads.
std::vector<Region> regions_of(const Partition& parts, const Offer& offer);
/// A box cut into about so many, across up to three axes; what is to be cut most often is the
/// longest axis. Of an extent alone, so that bytes depend on nothing else.
std::vector<Region> boxes_of(const Extent& extent, int count);
/// Bytes of the parts that are merged, in addition to the output itself: with Partition::input
/// every region but the first has one. Planner and runtime count them; Work does not.
double part_bytes(const Partition& parts, const Offer& offer);

/// All edges that a planner may use; the order breaks ties, and is the order of preparations.
///
/// A value: copying it shares the edges, and so do plans, which may outlive it. An edge that is
/// shared never changes: writing to one through operator[] first makes a copy of it.
class Catalogue {
 public:
    Catalogue() = default;
    Catalogue(std::initializer_list<Transition> edges) {
        for (const Transition& edge : edges) push_back(edge);
    }

    void push_back(Transition edge) {
        edges_.push_back(std::make_shared<Transition>(std::move(edge)));
        joins_ = std::make_shared<LateJoins>();
    }
    std::size_t size() const noexcept { return edges_.size(); }
    bool empty() const noexcept { return edges_.empty(); }
    const Transition& operator[](std::size_t place) const { return *edges_[place]; }
    Transition& operator[](std::size_t place) {
        joins_ = std::make_shared<LateJoins>();
        if (edges_[place].use_count() > 1)
            edges_[place] = std::make_shared<Transition>(*edges_[place]);
        return *edges_[place];
    }
    const Transition& back() const { return *edges_.back(); }
    /// Worked out when somebody asks first. Copies share it.
    const Joins& joins() const;
    /// For a plan to keep.
    std::shared_ptr<const Transition> shared(std::size_t place) const { return edges_[place]; }

    /// Walks the edges in order.
    class Iterator {
     public:
        using iterator_category = std::forward_iterator_tag;
        using value_type = Transition;
        using difference_type = std::ptrdiff_t;
        using pointer = const Transition*;
        using reference = const Transition&;

        Iterator() = default;
        reference operator*() const { return **at_; }
        pointer operator->() const { return at_->get(); }
        Iterator& operator++() {
            ++at_;
            return *this;
        }
        Iterator operator++(int) {
            Iterator before = *this;
            ++at_;
            return before;
        }
        bool operator==(const Iterator& other) const = default;

     private:
        friend class Catalogue;
        using Place = std::vector<std::shared_ptr<Transition>>::const_iterator;
        explicit Iterator(Place at) : at_(at) {}
        Place at_ = {};
    };
    Iterator begin() const { return Iterator(edges_.begin()); }
    Iterator end() const { return Iterator(edges_.end()); }

 private:
    struct LateJoins {
        std::once_flag once;
        std::optional<Joins> joins;
    };
    std::vector<std::shared_ptr<Transition>> edges_;
    std::shared_ptr<LateJoins> joins_ = std::make_shared<LateJoins>();
};

}  // namespace edgewise
