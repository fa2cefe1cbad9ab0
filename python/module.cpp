// The library for Python: NumPy arrays in, NumPy arrays out. Arrays are [z, y, x] or [y, x], with
// channels last.
#include <algorithm>
#include <atomic>
#include <edgewise/edgewise.hpp>
#include <map>
#include <optional>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <ranges>
#include <string>
#include <utility>
#include <vector>

#include "inside.hpp"

namespace py = pybind11;
using namespace edgewise;
using python::Inside, python::interruptible;

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
        const auto numpy = py::module_::import("numpy");
        const bool rounds = kind != 'f' && array.size() > 0 &&
                            (numpy.attr("max")(array).cast<double>() > 0x1p24 ||
                             numpy.attr("min")(array).cast<double>() < -0x1p24);
        warn("the array is copied: samples of " + py::str(array.dtype()).cast<std::string>() +
             " are read as float32" +
             (rounds ? ", which rounds those beyond 16777216: labels among them merge" : ""));
        return numpy.attr("ascontiguousarray")(array, "f4");
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

/// The same values in another type, where it is another.
py::array of_type(const py::array& array, Type type) {
    if (array.dtype().equal(dtype_of(type))) return array;
    py::array other = array.attr("astype")(dtype_of(type));
    other.attr("setflags")(py::arg("write") = false);
    return other;
}

// Queries

/// What settings take: a text, a number, a truth, or a list or array of these.
SettingValue value_of(const py::handle& value) {
    if (py::isinstance<py::bool_>(value)) return py::cast<bool>(value);
    if (py::isinstance<py::int_>(value)) return py::cast<std::int64_t>(value);
    if (py::isinstance<py::float_>(value)) return py::cast<double>(value);
    if (py::isinstance<py::str>(value)) return py::cast<std::string>(value);
    if (py::hasattr(value, "tolist")) return value_of(value.attr("tolist")());
    if (py::hasattr(value, "__fspath__"))
        return py::cast<std::string>(py::str(value.attr("__fspath__")()));
    SettingValue::List list;
    for (const py::handle& one : value) list.push_back(value_of(one));
    return list;
}

/// As everything that is along axes in NumPy, numbers along axes go from the last axis to x.
SettingValue along_axes(const QuerySetting* row, SettingValue value) {
    if (!row || !row->per_axis || !value.is_list()) return value;
    SettingValue::List list = value.values();
    std::reverse(list.begin(), list.end());
    return list;
}

Job job_of(const std::string& name) {
    std::string names;
    for (const Job job : jobs()) {
        if (name_of(job) == name) return job;
        names += (names.empty() ? "" : ", ") + std::string(name_of(job));
    }
    throw py::value_error("job: one of " + names + " is expected, not " + name);
}

/// What acts on nothing here would be ignored.
void expect_acts(const QuerySetting* row, QuerySetting::Acts acts) {
    if (!row || row->acts == acts) return;
    const std::string name = "'" + std::string(row->name.name) + "'";
    switch (row->acts) {
        case QuerySetting::Acts::input:
            throw py::type_error(name + " is said when a volume is read: edgewise.read");
        case QuerySetting::Acts::output:
            throw py::type_error(name + " means nothing for results that are not written");
        default:
            throw py::type_error(name + " says nothing of the input; it is one of edgewise.plan");
    }
}

/// Keywords that are settings of a job; None is none. A mistake in them is told before any work.
std::vector<Given> given_by(const py::kwargs& keywords, Job job, QuerySetting::Acts acts) {
    std::vector<Given> given;
    for (const auto& [key, value] : keywords) {
        const auto name = py::cast<std::string>(key);
        const QuerySetting* row = setting_named(name, job);
        expect_acts(row, acts);
        if (value.is_none() && row) continue;
        try {
            given.push_back({name, along_axes(row, value_of(value))});
        } catch (const std::exception&) {
            PyErr_Clear();
            throw py::type_error(name + ": " + py::repr(value).cast<std::string>() +
                                 " is of another type than expected");
        }
    }
    return given;
}

Query query_by(const std::string& job, const py::kwargs& keywords) {
    const Job which = job_of(job);
    return query_of(which, given_by(keywords, which, QuerySetting::Acts::result));
}

/// The channel that keywords name, in place of all of a volume's; it is taken out of them.
std::optional<int> channel_of(Volume& volume, py::kwargs& keywords) {
    if (!keywords.contains("channel")) return {};
    keywords = py::reinterpret_steal<py::kwargs>(PyDict_Copy(keywords.ptr()));
    const py::object value = keywords.attr("pop")("channel");
    if (value.is_none()) return {};
    py::kwargs alone;
    alone["channel"] = value;
    // All jobs read alike.
    const Query query = query_of(Job::warp, given_by(alone, Job::warp, QuerySetting::Acts::input));
    const std::optional<int> number = query.selection.channel;
    volume = number ? volume.channel(*number) : volume.channel(query.channel_name);
    return number ? number : volume.input().selection.channel;
}

// Work

class Messages final : public Listener {
 public:
    const std::atomic<bool>& stop() const noexcept override { return ends; }
    std::atomic<bool> ends = false;
};

/// Where `edgewise calibrate` leaves its profile.
std::string profile_folder;

const Engine& engine() {
    static const Engine one = default_engine(profile_folder);
    return one;
}

struct PyPlan {
    Prepared prepared;
    std::optional<int> channel = {};  // of several, that it was made for

    py::object run() const {
        std::atomic<bool> stop = false;
        const bool mesh = prepared.planned().want.job == Job::mesh;
        if (prepared.frames() == 1 || mesh) {
            const auto result = interruptible(
                stop, [&] { return prepared.run({.stop = &stop, .keep_frames = true}); });
            if (mesh) return surface_of(result.frames[0]);
            return of_type(array_of(result.frames[0]), result_type(prepared));
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

PyPlan plan_of(Volume volume, const std::string& job, py::kwargs keywords) {
    const std::optional<int> channel = channel_of(volume, keywords);
    Query query = query_by(job, keywords);
    Messages messages;
    Prepared prepared =
        interruptible(messages.ends, [&] { return prepare(engine(), query, volume, messages); });
    for (const Message& warning : messages.warnings()) warn(warning.text());
    return {std::move(prepared), channel};
}

/// @param channels  of arrays: the last axis is none of the volume's
Volume as_volume(const py::object& input, bool channels = false) {
    if (py::isinstance<Volume>(input)) return py::cast<Volume>(input);
    if (py::isinstance<py::array>(input))
        return volume_of(py::cast<py::array>(input), py::none(), py::none(), py::none(), "mm",
                         channels);
    return Volume::read(py::str(input).cast<std::string>());
}

int channels_of(const Volume& volume) {
    if (volume.data()) return volume.data()->what.channels;
    return volume.input().selection.channel ? 1 : volume.header().channels;
}

PyPlan told(const std::vector<Message>& warnings, PyPlan plan) {
    for (const Message& warning : warnings) warn(warning.text());
    return plan;
}

PyPlan with_input(const PyPlan& self, const py::object& input) {
    const store::Header& planned = self.prepared.planned().input.header;
    const bool channels = self.channel && py::isinstance<py::array>(input) &&
                          py::cast<py::array>(input).ndim() == (planned.volume ? 4 : 3);
    Volume volume = as_volume(input, channels);
    if (self.channel && channels_of(volume) > 1) volume = volume.channel(*self.channel);
    const store::Header& has = volume.header();
    if (!py::isinstance<py::array>(input) &&
        (has.spacing != planned.spacing || has.origin != planned.origin ||
         has.direction != planned.direction))
        throw py::value_error(
            "with_input: spacing, origin and direction are those of the plan's volume; plan anew "
            "where they differ");
    PyPlan plan = [&] {
        const py::gil_scoped_release unlocked;
        return PyPlan{self.prepared.with_input(volume.samples()), self.channel};
    }();
    const auto& warnings = plan.prepared.warnings();
    return told(warnings, plan);
}

/// Views that are not named stay: size, spacing, perspective. Steps are replaced as a whole.
PyPlan with_views(const PyPlan& self, const py::kwargs& keywords) {
    Query query = self.prepared.planned().query;
    query.geometry.steps.clear();
    for (const Given& one : given_by(keywords, query.job, QuerySetting::Acts::result)) {
        const bool of_views =
            one.name != "crop" &&
            std::ranges::any_of(geometry_settings(),
                                [&](const QuerySetting& row) { return row.name.name == one.name; });
        if (!of_views)
            throw py::type_error("with_views: '" + one.name + "' is no keyword of views");
        set(query, one.name, one.value);
    }
    PyPlan plan = [&] {
        const py::gil_scoped_release unlocked;
        return PyPlan{self.prepared.with_views(query.geometry), self.channel};
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
    if (channels_of(volume) > 1) shape.append(channels_of(volume));
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

Volume volume_in(const py::object& file, const py::kwargs& keywords) {
    // All jobs read alike.
    const Query query =
        query_of(Job::warp, given_by(keywords, Job::warp, QuerySetting::Acts::input));
    if (query.level_by_result || !query.channel_name.empty())
        throw py::value_error("read: a number of the level and of the channel is expected");
    return Volume::read(py::str(file).cast<std::string>(), query.selection);
}

template <const char* job>
py::object do_job(const py::object& input, const py::kwargs& keywords) {
    return plan_of(as_volume(input), job, keywords).run();
}
constexpr char kRender[] = "render", kWarp[] = "warp", kFilter[] = "filter", kMesh[] = "mesh",
               kRadon[] = "radon";

/// Each a dict of settings that would do: what is to be given, None for what is to be left out.
py::list ways_out_of(const NoPlan& none) {
    py::list ways;
    const auto* infeasible = dynamic_cast<const Infeasible*>(&none);
    if (!infeasible) return ways;
    for (const auto* lists : {&infeasible->way_out.budgets, &infeasible->way_out.demands})
        for (const std::vector<SettingChange>& changes : *lists) {
            py::dict way;
            for (const SettingChange& change : changes)
                way[py::str(std::string(change.setting.name))] =
                    change.value ? py::object(py::str(*change.value)) : py::none();
            ways.append(way);
        }
    return ways;
}

/// @param named  attributes of the exception
void raise(const py::object& type, const char* text, const py::dict& named) {
    const py::object error = type(text);
    for (const auto& [name, value] : named) py::setattr(error, name, value);
    PyErr_SetObject(type.ptr(), error.ptr());
}

void translate_errors(py::module_& module) {
    static py::exception<RunError> run_error(module, "RunError", PyExc_RuntimeError);
    static py::exception<NoPlan> infeasible(module, "Infeasible", PyExc_ValueError);
    static py::exception<RequestError> request_error(module, "RequestError", PyExc_ValueError);
    py::register_exception_translator([](std::exception_ptr error) {
        try {
            if (error) std::rethrow_exception(error);
        } catch (const NoPlan& none) {
            raise(infeasible, none.what(), py::dict(py::arg("ways_out") = ways_out_of(none)));
        } catch (const SettingError& none) {
            PyErr_SetString(PyExc_TypeError, none.what());
        } catch (const RequestError& wrong) {
            const auto* out = dynamic_cast<const OutOfLimits*>(&wrong);
            const Limits limits = out ? out->limits() : Limits();
            raise(request_error, wrong.what(),
                  py::dict(py::arg("field") = wrong.field(), py::arg("value") = wrong.value(),
                           py::arg("least") = limits.least, py::arg("greatest") = limits.greatest,
                           py::arg("allowed") = py::tuple(py::cast(limits.allowed))));
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

/// "  zoom=Z (render): more than 1 shows ..."
std::string help_of(const QuerySetting& row, const std::string& jobs, Job job) {
    const std::string value = row.value(job).text();
    return "  " + std::string(row.name.name) + (value.empty() ? "" : "=" + value) + " (" + jobs +
           "): " + row.help(job).text() + "\n";
}

/// What settings are for, from their table.
std::string help_of(QuerySetting::Acts acts) {
    std::string text;
    for (const QuerySetting* row : settings()) {
        if (row->acts != acts) continue;
        std::string names;
        for (const Job job : jobs())
            if (row->of(job)) names += (names.empty() ? "" : ", ") + std::string(name_of(job));
        const Job first =
            *std::ranges::find_if(jobs(), [&](const Job job) { return row->of(job); });
        text += help_of(*row, names, first);
    }
    return text;
}

constexpr const char* kPlanHelp = R"(plan(volume, job="render", **query) -> Plan

Chooses the cheapest path. volume: a Volume, an array [z, y, x] or [y, x], or a file's name. job: render, warp, mesh, filter or radon.
An array must not change while a plan has it: what all runs need is worked out once.
Keywords take numbers, lists and arrays, or texts as they are written here. Numbers along axes (size, spacing) are z, y, x, or y, x;
steps of the geometry and places are x, y, z. Steps (rotate ... path) apply in the order given.
channel=N (or a file's name for it) takes one channel of several.
A filter's result has the type of the samples where all its values are samples (median; dilate, erode, open and close with
flat kernels); else it is float32, of a file's 32-bit integers and float64 it is float64. The path does not matter.

)";
constexpr const char* kReadHelp = R"(read(file, **selection) -> Volume

Reads a header; samples when they are needed.

)";

}  // namespace

// clang-format off
PYBIND11_MODULE(edgewise, module) {
    module.doc() = "The cheapest way from a volume to the picture that one wants. Arrays are [z, y, x], channels last.";
    translate_errors(module);
    using Guarded = py::call_guard<Inside>;
    py::module_::import("atexit").attr("register")(py::cpp_function([] { python::doors().close(); }));
    const py::object os = py::module_::import("os");
    const py::object home = os.attr("path").attr("expanduser")("~/.config");
    profile_folder = py::str(os.attr("environ").attr("get")("XDG_CONFIG_HOME", home)).cast<std::string>() + "/edgewise";
    py::class_<Volume>(module, "Volume", "Samples and where they lie. Of an array nothing is copied where kernels can read it.")
        .def(py::init(&volume_around), py::arg("array"), py::arg("spacing") = py::none(), py::arg("origin") = py::none(),
             py::arg("direction") = py::none(), py::arg("unit") = "mm", py::arg("channels") = false, Guarded(),
             "spacing and origin: z, y, x. direction: columns are where x, y and z point (LPS).")
        .def_property_readonly("shape", &shape_of)
        .def_property_readonly("spacing", &spacing_of, "Along z, y and x.")
        .def_property_readonly("unit", [](const Volume& v) { return v.header().unit; })
        .def_property_readonly("format", [](const Volume& v) { return v.header().format; })
        .def("loaded", &Volume::loaded, Guarded(), "The same with its samples in memory: a file is read once for all plans of it.")
        .def("array", &samples_of, Guarded(), "The samples, read now, as an array that cannot be written.");
    py::class_<PyPlan>(module, "Plan", "A plan: runs again and again, from any thread.")
        .def("run", &PyPlan::run, Guarded(), "[y, x], [z, y, x], with frames first and channels last; of a mesh (vertices, triangles).")
        .def("with_input", &with_input, Guarded(), py::arg("volume"), "The same with other samples of the same shape and type.")
        .def("with_views", &with_views, Guarded(), "The same seen from elsewhere: keywords of views, as of plan(). What is not named stays.")
        .def_property_readonly("steps", [](const PyPlan& p) { return p.prepared.plan().texts(); })
        .def_property_readonly("frames", [](const PyPlan& p) { return p.prepared.frames(); })
        .def_property_readonly("predicted", &prediction_of);
    static const std::string read_help = kReadHelp + help_of(QuerySetting::Acts::input), plan_help = kPlanHelp + help_of(QuerySetting::Acts::result);
    module.def("read", &volume_in, Guarded(), py::arg("file"), read_help.c_str());
    module.def("plan", [](const py::object& volume, const std::string& job, const py::kwargs& query) {
        return plan_of(as_volume(volume), job, query);
    }, py::arg("volume"), py::arg("job") = "render", Guarded(), plan_help.c_str());
    module.def("render", &do_job<kRender>, Guarded(), py::arg("volume"), "plan(volume, 'render', **query).run()");
    module.def("warp", &do_job<kWarp>, Guarded(), py::arg("volume"), "plan(volume, 'warp', **query).run()");
    module.def("filter", &do_job<kFilter>, Guarded(), py::arg("volume"), "plan(volume, 'filter', **query).run()");
    module.def("radon", &do_job<kRadon>, Guarded(), py::arg("volume"), "plan(volume, 'radon', **query).run(): one row an angle");
    module.def("mesh", &do_job<kMesh>, Guarded(), py::arg("volume"), "plan(volume, 'mesh', **query).run(): vertices [n, 3] in x, y, z, triangles [m, 3]");
    module.attr("__version__") = version();
}
