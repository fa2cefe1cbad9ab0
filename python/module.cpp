// The library for Python: NumPy arrays in, NumPy arrays out. Arrays are [z, y, x] or [y, x], with
// channels last.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <edgewise/edgewise.hpp>
#include <future>
#include <map>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;
using namespace edgewise;

namespace {

// NumPy and samples

/// What kernels read; f64: nothing that they do, so that it is converted to f32.
Type type_of(const py::array& array) {
    const char kind = array.dtype().kind();
    const auto size = array.itemsize();
    if (kind == 'b') return Type::u8;
    if (!array.dtype().attr("isnative").cast<bool>()) return Type::f64;
    if (kind == 'u') return size == 1 ? Type::u8 : size == 2 ? Type::u16 : Type::f64;
    if (kind == 'i') return size == 1 ? Type::i8 : size == 2 ? Type::i16 : Type::f64;
    return kind == 'f' && size == 4 ? Type::f32 : Type::f64;
}

py::dtype dtype_of(Type type) {
    static const std::map<Type, const char*> names = {
        {Type::u8, "u1"},  {Type::i8, "i1"},  {Type::u16, "u2"}, {Type::i16, "i2"},
        {Type::u32, "u4"}, {Type::i32, "i4"}, {Type::f16, "f2"}, {Type::f32, "f4"},
        {Type::f64, "f8"}, {Type::c64, "c8"}};
    return py::dtype(names.at(type));
}

void warn(const std::string& text) {
    if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), 1) != 0) throw py::error_already_set();
}

/// The array itself where kernels read it, else a copy, which a warning tells of.
py::array readable(const py::array& array) {
    if (type_of(array) == Type::f64) {
        const char kind = array.dtype().kind();
        if (kind != 'u' && kind != 'i' && kind != 'f')
            throw py::value_error("an array of integers or floats is expected, and this is " +
                                  py::str(array.dtype()).cast<std::string>());
        warn("the array is copied: samples of " + py::str(array.dtype()).cast<std::string>() +
             " are read as float32");
        return py::module_::import("numpy").attr("ascontiguousarray")(array, "f4");
    }
    if (array.flags() & py::array::c_style) return array;
    warn("the array is copied: its rows are not one after another (numpy.ascontiguousarray)");
    return py::module_::import("numpy").attr("ascontiguousarray")(array);
}

/// Holds a reference to an object; gives it back under the interpreter's lock.
std::shared_ptr<const void> owner_of(const py::object& object) {
    auto* held = new py::object(object);
    return {held, [](const void* one) {
                const py::gil_scoped_acquire locked;
                delete static_cast<const py::object*>(one);
            }};
}

template <std::size_t N>
std::array<double, N> numbers(const py::handle& value, const char* what) {
    const auto all = py::cast<std::vector<double>>(value);
    if (all.size() != N)
        throw py::value_error(std::string(what) + ": " + std::to_string(N) +
                              " numbers are expected, " + std::to_string(all.size()) + " given");
    std::array<double, N> out{};
    std::copy(all.begin(), all.end(), out.begin());
    return out;
}

/// As everything that is along axes in NumPy: z, y, x.
std::array<double, 3> reversed(const py::handle& value, std::size_t axes, double rest) {
    std::array<double, 3> out{rest, rest, rest};
    const std::vector<double> given = py::isinstance<py::sequence>(value)
                                          ? py::cast<std::vector<double>>(value)
                                          : std::vector<double>(axes, py::cast<double>(value));
    if (given.size() != axes)
        throw py::value_error("one number, or one for each axis, is expected");
    std::copy(given.rbegin(), given.rend(), out.begin());
    return out;
}

Volume volume_of(const py::array& array, const py::object& spacing, const py::object& origin,
                 const py::object& direction, const std::string& unit, bool channels) {
    const auto axes = static_cast<std::size_t>(array.ndim() - (channels ? 1 : 0));
    if (axes != 2 && axes != 3)
        throw py::value_error("an array of 2 or 3 axes is expected (channels=True: one more)");
    const py::array held = readable(array);
    const auto side = [&](std::size_t k) {
        return static_cast<std::int64_t>(held.shape(static_cast<py::ssize_t>(axes - 1 - k)));
    };
    const Extent extent{side(0), side(1), axes == 3 ? side(2) : 1};
    Grid grid;
    grid.unit = unit;
    if (!spacing.is_none()) grid.spacing = reversed(spacing, axes, 1);
    if (!origin.is_none()) grid.origin = reversed(origin, axes, 0);
    if (!direction.is_none()) {
        const auto rows = py::cast<std::vector<std::vector<double>>>(direction);
        if (rows.size() != 3 || rows[0].size() != 3 || rows[1].size() != 3 || rows[2].size() != 3)
            throw py::value_error("direction: a matrix of 3 x 3 is expected");
        // Columns are where x, y and z point, as DICOM and ITK have them.
        for (std::size_t r = 0; r < 3; ++r)
            for (std::size_t c = 0; c < 3; ++c) grid.direction[c][r] = rows[r][c];
        grid.anatomical = true;
    }
    const int count = channels ? static_cast<int>(held.shape(static_cast<py::ssize_t>(axes))) : 1;
    return Volume::around(held.data(), extent, static_cast<int>(axes), count, type_of(held),
                          owner_of(held), grid);
}

Volume volume_around(const py::array& array, const py::object& spacing, const py::object& origin,
                     const py::object& direction, const std::string& unit, bool channels) {
    try {
        return volume_of(array, spacing, origin, direction, unit, channels);
    } catch (const py::cast_error&) {
        throw py::type_error(
            "Volume: spacing and origin are numbers along z, y and x, direction a matrix of 3 x 3");
    }
}

/// Samples as an array that keeps them alive and cannot be written.
py::array array_of(const std::shared_ptr<const Data>& data) {
    const Representation& what = data->what;
    std::vector<py::ssize_t> shape;
    if (what.axes == 3) shape.push_back(what.extent.z);
    shape.insert(shape.end(), {what.extent.y, what.extent.x});
    if (what.channels > 1) shape.push_back(what.channels);
    auto* held = new std::shared_ptr<const Data>(data);
    const py::capsule owner(
        held, [](void* one) { delete static_cast<std::shared_ptr<const Data>*>(one); });
    py::array array(dtype_of(what.type), shape, {}, data->samples.data(), owner);
    array.attr("setflags")(py::arg("write") = false);
    if (what.values.identity()) return array;
    py::array values = (array.attr("astype")("f8") * py::float_(what.values.slope) +
                        py::float_(what.values.offset))
                           .attr("astype")("f4");
    values.attr("setflags")(py::arg("write") = false);
    return values;
}

// Queries

using Setter = void (*)(Query& query, const py::handle& value);

std::vector<double> list_of(const py::handle& value) {
    if (py::isinstance<py::array>(value) || py::isinstance<py::sequence>(value))
        return py::cast<std::vector<double>>(py::module_::import("numpy").attr("ravel")(value));
    return {py::cast<double>(value)};
}

template <GeometryStep::Kind kind>
void step(Query& query, const py::handle& value) {
    query.geometry.steps.push_back({kind, list_of(value)});
}

void set_size(Query& query, const py::handle& value) {
    OutputSize size;
    if (py::isinstance<py::str>(value)) {
        const auto word = py::cast<std::string>(value);
        size.native = word == "native", size.fit = word == "fit";
        if (!size.native && !size.fit) throw py::value_error("size: 'native' or 'fit'");
    } else if (py::isinstance<py::sequence>(value)) {
        size.sides = py::cast<std::vector<std::int64_t>>(value);
        std::reverse(size.sides.begin(), size.sides.end());
    } else {
        size.sides = {py::cast<std::int64_t>(value)};
    }
    query.geometry.size = size;
}

void set_kernel(Query& query, const py::handle& value) {
    KernelSpec& kernel = query.filter->kernel;
    using Kind = KernelSpec::Kind;
    if (!py::isinstance<py::str>(value)) {
        const auto weights =
            py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(value);
        if (!weights || weights.ndim() < 2 || weights.ndim() > 3)
            throw py::value_error("kernel: a name with its size ('gauss:2'), or an array");
        const auto axes = static_cast<std::size_t>(weights.ndim());
        const auto side = [&](std::size_t k) {
            return k < axes ? static_cast<std::int64_t>(
                                  weights.shape(static_cast<py::ssize_t>(axes - 1 - k)))
                            : 1;
        };
        kernel.kind = Kind::given;
        kernel.given.extent = {side(0), side(1), side(2)};
        kernel.given.weights.assign(weights.data(), weights.data() + weights.size());
        kernel.given.name = "array";
        return;
    }
    static const std::map<std::string, Kind> kinds = {
        {"box", Kind::box},     {"gauss", Kind::gauss}, {"sphere", Kind::sphere},
        {"cross", Kind::cross}, {"sobel", Kind::sobel}, {"laplace", Kind::laplace}};
    const auto text = py::cast<std::string>(value);
    const auto colon = text.find(':');
    const auto found = kinds.find(text.substr(0, colon));
    if (found == kinds.end())
        throw py::value_error(
            "kernel: box, gauss, sphere, cross, sobel or laplace is expected, not " + text);
    kernel.kind = found->second;
    if (colon == text.npos) return;
    std::size_t end = 0;
    const std::string number = text.substr(colon + 1);
    try {
        kernel.size = std::stod(number, &end);
    } catch (const std::exception&) {
        end = 0;
    }
    if (end == 0 || end != number.size())
        throw py::value_error("kernel: '" + text +
                              "' given; a name and one number is expected, as 'gauss:1.5'");
}

void set_transfer(Query& query, const py::handle& value) {
    query.transfer = preset_or_file(py::cast<std::string>(value));
}

void set_minimize(Query& query, const py::handle& value) {
    for (const Minimize one : {Minimize::time, Minimize::error, Minimize::memory})
        if (name_of(one) == py::cast<std::string>(value)) {
            query.minimize = one;
            return;
        }
    throw py::value_error("minimize: time, error or memory");
}

void set_reference(Query& query, const py::handle& value) {
    static const std::map<std::string, Field> fields = {
        {"spline", Field::spline}, {"linear", Field::linear}, {"nearest", Field::nearest}};
    const auto found = fields.find(py::cast<std::string>(value));
    if (found == fields.end()) throw py::value_error("reference: spline, linear or nearest");
    query.reference = found->second;
}

template <auto member>
void demands(Query& query, const py::handle& value) {
    static const Catalogue edges = catalogue();
    const auto texts = py::isinstance<py::str>(value)
                           ? std::vector<std::string>{py::cast<std::string>(value)}
                           : py::cast<std::vector<std::string>>(value);
    for (const std::string& text : texts) (query.demands.*member).push_back(demand_of(text, edges));
}

const std::map<std::string, Setter>& setters() {
    using Kind = GeometryStep::Kind;
    // clang-format off
    static const std::map<std::string, Setter> all = {
        {"mode", [](Query& q, const py::handle& v) {q.mode = mode_named(py::cast<std::string>(v)); }},
        {"rotate", step<Kind::rotate>},
        {"scale", step<Kind::scale>},
        {"translate", step<Kind::translate>},
        {"shear", step<Kind::shear>},
        {"matrix", step<Kind::matrix>},
        {"turntable", step<Kind::turntable>},
        {"view", [](Query& q, const py::handle& v) {q.geometry.view = py::cast<std::string>(v); }},
        {"about", [](Query& q, const py::handle& v) {q.geometry.about = list_of(v); }},
        {"perspective", [](Query& q, const py::handle& v) {q.geometry.perspective = py::cast<double>(v); }},
        {"zoom", [](Query& q, const py::handle& v) {q.geometry.zoom = py::cast<double>(v); }},
        {"size", set_size},
        {"spacing", [](Query& q, const py::handle& v) {q.geometry.spacing = list_of(v); std::reverse(q.geometry.spacing->begin(), q.geometry.spacing->end()); }},
        {"isovalue", [](Query& q, const py::handle& v) {q.isovalue = py::cast<double>(v); }},
        {"zero", [](Query& q, const py::handle& v) {q.zero = py::cast<double>(v); }},
        {"outside", [](Query& q, const py::handle& v) {q.outside = py::cast<double>(v); }},
        {"background", [](Query& q, const py::handle& v) {q.background = numbers<3>(v, "background"); }},
        {"window", [](Query& q, const py::handle& v) {const auto ends = numbers<2>(v, "window"); q.window = Window{{ends[0], false}, {ends[1], false}}; }},
        {"transfer", set_transfer},
        {"labels", [](Query& q, const py::handle& v) {q.labels = py::cast<bool>(v); }},
        {"reference", set_reference},
        {"op", [](Query& q, const py::handle& v) {q.filter->op = filter_op_named(py::cast<std::string>(v)); }},
        {"kernel", set_kernel},
        {"border", [](Query& q, const py::handle& v) {q.filter->border = border_named(py::cast<std::string>(v)); }},
        {"max_error", [](Query& q, const py::handle& v) {q.max_error = py::cast<double>(v); }},
        {"max_time", [](Query& q, const py::handle& v) {q.max_time = py::cast<double>(v); }},
        {"max_memory", [](Query& q, const py::handle& v) {q.max_memory = py::cast<double>(v); }},
        {"minimize", set_minimize},
        {"threads", [](Query& q, const py::handle& v) {q.threads = py::cast<int>(v); }},
        {"via", demands<&Demands::via>},
        {"without", demands<&Demands::without>},
    };
    // clang-format on
    return all;
}

Job job_of(const std::string& name) {
    for (const Job job : jobs())
        if (name_of(job) == name) return job;
    throw py::value_error("job: render, warp, filter or mesh is expected, not " + name);
}

/// What means something for one job alone would be ignored by the others.
void expect_of_job(const std::string& name, const Query& query) {
    // clang-format off
    static const std::map<std::string, std::vector<Job>> jobs_of = {
        {"mode", {Job::render}}, {"zero", {Job::render}}, {"window", {Job::render}}, {"background", {Job::render}}, {"transfer", {Job::render}},
        {"perspective", {Job::render}}, {"zoom", {Job::render}}, {"turntable", {Job::render}}, {"isovalue", {Job::render, Job::mesh}}, {"outside", {Job::warp}},
        {"op", {Job::filter}}, {"kernel", {Job::filter}}, {"border", {Job::filter}}, {"labels", {Job::render, Job::warp, Job::mesh}}};
    static const std::vector<std::string> geometry = {"rotate", "scale", "translate", "shear", "matrix", "view", "about", "size", "spacing"};
    // clang-format on
    const bool moves = query.job == Job::render || query.job == Job::warp;
    const auto found = jobs_of.find(name);
    const bool fits =
        found == jobs_of.end() ||
        std::find(found->second.begin(), found->second.end(), query.job) != found->second.end();
    if (!fits || (!moves && std::find(geometry.begin(), geometry.end(), name) != geometry.end()))
        throw py::type_error("'" + name + "' means nothing for " + std::string(name_of(query.job)));
}

Query query_of(const std::string& job, const py::kwargs& keywords) {
    Query query;
    query.job = job_of(job);
    query.remembers = false;
    if (query.job == Job::filter) query.filter.emplace();
    for (const auto& [key, value] : keywords) {
        const auto name = py::cast<std::string>(key);
        const auto found = setters().find(name);
        if (found == setters().end())
            throw py::type_error("'" + name +
                                 "' is no keyword of edgewise; help(edgewise.plan) lists them");
        if (value.is_none()) continue;
        expect_of_job(name, query);
        try {
            found->second(query, value);
        } catch (const py::cast_error&) {
            throw py::type_error(name + ": " + py::repr(value).cast<std::string>() +
                                 " is of another type than expected");
        }
    }
    return query;
}

// Work

/// Does work in a thread of its own, without the interpreter's lock; Ctrl-C sets the flag.
template <class Work>
auto interruptible(std::atomic<bool>& stop, Work work) {
    auto done = std::async(std::launch::async, work);
    bool interrupted = false;
    for (;;) {
        {
            const py::gil_scoped_release unlocked;
            if (done.wait_for(std::chrono::milliseconds(20)) == std::future_status::ready) break;
        }
        if (!interrupted && PyErr_CheckSignals() != 0) stop = interrupted = true;
    }
    if (interrupted) {
        try {
            done.get();
        } catch (...) {
        }
        throw py::error_already_set();
    }
    return done.get();
}

class Messages final : public Listener {
 public:
    const std::atomic<bool>& stop() const noexcept override { return ends; }
    std::atomic<bool> ends = false;
};

const Engine& engine() {
    static const Engine one = default_engine();
    return one;
}

struct PyPlan {
    Prepared prepared;

    py::object run() const {
        std::atomic<bool> stop = false;
        const bool mesh = prepared.planned().want.job == Job::mesh;
        if (prepared.frames() == 1 || mesh) {
            const auto result = interruptible(
                stop, [&] { return prepared.run({.stop = &stop, .keep_frames = true}); });
            return mesh ? surface_of(result.frames[0]) : py::object(array_of(result.frames[0]));
        }
        const Representation what = prepared.result();
        std::vector<py::ssize_t> shape{prepared.frames(), what.extent.y, what.extent.x};
        if (what.channels > 1) shape.push_back(what.channels);
        py::array all(dtype_of(what.type), shape);
        const std::span into(static_cast<std::byte*>(all.mutable_data()),
                             static_cast<std::size_t>(all.nbytes()));
        interruptible(stop, [&] { return prepared.run({.stop = &stop, .into = into}); });
        all.attr("setflags")(py::arg("write") = false);
        return all;
    }
    static py::object surface_of(const std::shared_ptr<const Data>& data) {
        const auto mesh = surface::mesh_in(*data);
        // The mesh goes before what counts its bytes.
        using Held = std::pair<std::shared_ptr<const Data>, std::shared_ptr<const surface::Mesh>>;
        auto* held = new Held(data, mesh);
        const py::capsule keeps(held, [](void* one) { delete static_cast<Held*>(one); });
        const auto view = [&](const py::dtype& type, std::size_t rows, const void* first) {
            py::array array(type, {static_cast<py::ssize_t>(rows), py::ssize_t{3}}, {}, first,
                            keeps);
            array.attr("setflags")(py::arg("write") = false);
            return array;
        };
        return py::make_tuple(
            view(py::dtype("f4"), mesh->positions().size(), mesh->positions().data()),
            view(py::dtype("u4"), mesh->triangles().size(), mesh->triangles().data()));
    }
};

PyPlan plan_of(const Volume& volume, const std::string& job, const py::kwargs& keywords) {
    Query query = query_of(job, keywords);
    Messages messages;
    Prepared prepared =
        interruptible(messages.ends, [&] { return prepare(engine(), query, volume, messages); });
    for (const Message& warning : messages.warnings()) warn(warning.text());
    return {std::move(prepared)};
}

Volume as_volume(const py::object& input) {
    if (py::isinstance<Volume>(input)) return py::cast<Volume>(input);
    if (py::isinstance<py::array>(input))
        return volume_of(py::cast<py::array>(input), py::none(), py::none(), py::none(), "mm",
                         false);
    return Volume::read(py::str(input).cast<std::string>());
}

PyPlan told(const std::vector<Message>& warnings, PyPlan plan) {
    for (const Message& warning : warnings) warn(warning.text());
    return plan;
}

PyPlan with_input(const PyPlan& self, const py::object& input) {
    const Volume volume = as_volume(input);
    const store::Header &has = volume.header(), &planned = self.prepared.planned().input.header;
    if (!py::isinstance<py::array>(input) &&
        (has.spacing != planned.spacing || has.origin != planned.origin ||
         has.direction != planned.direction))
        throw py::value_error(
            "with_input: spacing, origin and direction are those of the plan's volume; plan anew "
            "where they differ");
    PyPlan plan = [&] {
        const py::gil_scoped_release unlocked;
        return PyPlan{self.prepared.with_input(volume.samples())};
    }();
    const auto& warnings = plan.prepared.warnings();
    return told(warnings, plan);
}

/// Views that are not named stay: size, spacing, perspective. Steps are replaced as a whole.
PyPlan with_views(const PyPlan& self, const py::kwargs& keywords) {
    static const std::vector<std::string> views = {
        "rotate", "scale", "translate",   "shear", "matrix", "turntable",
        "view",   "about", "perspective", "zoom",  "size",   "spacing"};
    const Planned& planned = self.prepared.planned();
    for (const auto& [key, value] : keywords)
        if (std::find(views.begin(), views.end(), py::cast<std::string>(key)) == views.end())
            throw py::type_error("with_views: '" + py::cast<std::string>(key) +
                                 "' is no keyword of views");
    const Query asked = query_of(std::string(name_of(planned.want.job)), keywords);
    GeometrySpec geometry = planned.query.geometry;
    geometry.steps = asked.geometry.steps;
    const auto take = [](auto& to, const auto& from) {
        if (from) to = from;
    };
    take(geometry.view, asked.geometry.view), take(geometry.about, asked.geometry.about);
    take(geometry.perspective, asked.geometry.perspective),
        take(geometry.zoom, asked.geometry.zoom);
    take(geometry.size, asked.geometry.size), take(geometry.spacing, asked.geometry.spacing);
    PyPlan plan = [&] {
        const py::gil_scoped_release unlocked;
        return PyPlan{self.prepared.with_views(geometry)};
    }();
    const auto& warnings = plan.prepared.warnings();
    return told(warnings, plan);
}

py::dict prediction_of(const PyPlan& self) {
    const Predicted& predicted = self.prepared.plan().predicted;
    py::dict out;
    out["seconds"] = predicted.seconds;
    out["bytes"] = predicted.bytes;
    out["error"] = predicted.known ? py::object(py::float_(predicted.error)) : py::none();
    return out;
}

py::tuple shape_of(const Volume& volume) {
    const store::Header& header = volume.header();
    py::list shape;
    if (header.volume) shape.append(header.extent.z);
    shape.append(header.extent.y), shape.append(header.extent.x);
    const int channels = volume.data() ? volume.data()->what.channels : header.channels;
    if (channels > 1) shape.append(channels);
    return py::tuple(shape);
}

py::tuple spacing_of(const Volume& volume) {
    const auto& s = volume.header().spacing;
    return volume.header().volume ? py::make_tuple(s[2], s[1], s[0]) : py::make_tuple(s[1], s[0]);
}

py::array samples_of(const Volume& volume) {
    std::shared_ptr<const Data> data;
    {
        const py::gil_scoped_release unlocked;
        data = volume.samples();
    }
    return array_of(data);
}

Volume volume_in(const py::object& file, const std::optional<std::string>& series,
                 std::optional<int> time, std::optional<int> channel, std::optional<int> level) {
    store::Selection selection;
    selection.series = series, selection.time = time, selection.channel = channel,
    selection.level = level;
    return Volume::read(py::str(file).cast<std::string>(), selection);
}

template <const char* job>
py::object do_job(const py::object& input, const py::kwargs& keywords) {
    return plan_of(as_volume(input), job, keywords).run();
}
constexpr char kRender[] = "render", kWarp[] = "warp", kFilter[] = "filter", kMesh[] = "mesh";

void translate_errors(py::module_& module) {
    static py::exception<RunError> run_error(module, "RunError", PyExc_RuntimeError);
    static py::exception<NoPlan> infeasible(module, "Infeasible", PyExc_ValueError);
    py::register_exception_translator([](std::exception_ptr error) {
        try {
            if (error) std::rethrow_exception(error);
        } catch (const NoPlan& none) {
            infeasible(none.what());
        } catch (const RequestError& wrong) {
            PyErr_SetString(PyExc_ValueError, wrong.what());
        } catch (const InputError& unreadable) {
            PyErr_SetString(PyExc_OSError, unreadable.what());
        } catch (const Cancelled& ended) {
            PyErr_SetString(PyExc_KeyboardInterrupt, ended.what());
        } catch (const RunError& failed) {
            run_error(failed.what());
        } catch (const std::bad_alloc&) {
            PyErr_SetString(PyExc_MemoryError, "no memory is left within the budget");
        }
    });
}

constexpr const char* kPlanHelp = R"(plan(volume, job="render", **query) -> Plan

Chooses the cheapest path. volume: a Volume, an array [z, y, x] or [y, x], or a file's name. job: render, warp, filter or mesh.
An array must not change while a plan has it: what all runs need is worked out once.
Views:   rotate=(x, y, z) in degrees, turntable=n, scale, translate, shear, matrix (in the order given), view, about,
         perspective, zoom, size=(y, x) or (z, y, x), spacing.
Picture: mode, isovalue, zero, background, transfer (a preset or a file). Warp: outside, labels. Filter: op, kernel, border.
Quality: max_error (NRMSE), max_time (s), max_memory (bytes), minimize ("time", "error", "memory"), reference, threads, via, without.
)";

}  // namespace

// clang-format off
PYBIND11_MODULE(edgewise, module) {
    module.doc() = "The cheapest way from a volume to the picture that one wants. Arrays are [z, y, x], channels last.";
    translate_errors(module);
    py::class_<Volume>(module, "Volume", "Samples and where they lie. Of an array nothing is copied where kernels can read it.")
        .def(py::init(&volume_around), py::arg("array"), py::arg("spacing") = py::none(), py::arg("origin") = py::none(),
             py::arg("direction") = py::none(), py::arg("unit") = "mm", py::arg("channels") = false,
             "spacing and origin: z, y, x. direction: columns are where x, y and z point (LPS).")
        .def_property_readonly("shape", &shape_of)
        .def_property_readonly("spacing", &spacing_of, "Along z, y and x.")
        .def_property_readonly("unit", [](const Volume& v) { return v.header().unit; })
        .def_property_readonly("format", [](const Volume& v) { return v.header().format; })
        .def("array", &samples_of, "The samples, read now, as an array that cannot be written.");
    py::class_<PyPlan>(module, "Plan", "A plan: runs again and again, from any thread.")
        .def("run", &PyPlan::run, "[y, x], [z, y, x], with frames first and channels last; of a mesh (vertices, triangles).")
        .def("with_input", &with_input, py::arg("volume"), "The same with other samples of the same shape and type.")
        .def("with_views", &with_views, "The same seen from elsewhere: keywords of views, as of plan(). What is not named stays.")
        .def_property_readonly("steps", [](const PyPlan& p) { return p.prepared.plan().texts(); })
        .def_property_readonly("frames", [](const PyPlan& p) { return p.prepared.frames(); })
        .def_property_readonly("predicted", &prediction_of);
    module.def("read", &volume_in, py::arg("file"), py::arg("series") = py::none(), py::arg("time") = py::none(),
               py::arg("channel") = py::none(), py::arg("level") = py::none(), "Reads a header; samples when they are needed.");
    module.def("plan", [](const py::object& volume, const std::string& job, const py::kwargs& query) {
        return plan_of(as_volume(volume), job, query);
    }, py::arg("volume"), py::arg("job") = "render", kPlanHelp);
    module.def("render", &do_job<kRender>, py::arg("volume"), "plan(volume, 'render', **query).run()");
    module.def("warp", &do_job<kWarp>, py::arg("volume"), "plan(volume, 'warp', **query).run()");
    module.def("filter", &do_job<kFilter>, py::arg("volume"), "plan(volume, 'filter', **query).run()");
    module.def("mesh", &do_job<kMesh>, py::arg("volume"), "plan(volume, 'mesh', **query).run(): vertices [n, 3] in x, y, z, triangles [m, 3]");
    module.attr("__version__") = version();
}
