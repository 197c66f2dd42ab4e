// The relief valve by Boost odeint: Dormand-Prince 5 with dense output, one trajectory at a time.
//
// Arguments: tolerance, maxima to pass, maxima to keep, impacts to keep, the model's four constants, the
// start, the bound of convergence, then the flows. Prints CPU seconds, then for each flow a line with the
// maxima passed, the times of the first impacts and the maxima kept ("nan" where there are none).

#include <array>
#include <boost/numeric/odeint.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <vector>

using State = std::array<double, 3>;  // lift, speed, pressure
namespace odeint = boost::numeric::odeint;

constexpr double missing = std::numeric_limits<double>::quiet_NaN();
constexpr int bisections = 36;  // of a step of 0.1, to 1.5e-12

struct Model {
    double kappa, beta, delta, restitution, q;
    void operator()(const State& y, State& rate, double) const {
        rate[0] = y[1];
        rate[1] = -kappa * y[1] - (y[0] + delta) + y[2];
        rate[2] = beta * (q - y[0] * std::sqrt(y[2]));
    }
};

struct Task {
    double tolerance, converged;
    std::size_t transient, recorded, impacts;
    State start;
};

struct Found {
    std::size_t passed = 0;
    std::vector<double> impacts, maxima;
};

// Time in (before, after] from which on y[index] has the sign it has at `after`.
template <class Stepper>
double crossing(Stepper& stepper, std::size_t index, double before, double after, bool above) {
    State y;
    for (int k = 0; k < bisections; ++k) {
        const double middle = 0.5 * (before + after);
        stepper.calc_state(middle, y);
        ((y[index] > 0.0) == above ? after : before) = middle;
    }
    return after;
}

Found run(const Model& model, const Task& task) {
    auto stepper = odeint::make_dense_output(task.tolerance, task.tolerance,
                                             odeint::runge_kutta_dopri5<State>());
    Found found;
    State from = task.start, turned, to;
    double last = missing;
    stepper.initialize(from, 0.0, 1e-8);
    while (true) {
        const auto [t0, t1] = stepper.do_step(model);
        to = stepper.current_state();
        double until = t1;
        const bool turns = from[1] * to[1] < 0.0;
        if (turns) {
            until = crossing(stepper, 1, t0, t1, to[1] > 0.0);
            stepper.calc_state(until, turned);
        }
        const bool sinks = turns && turned[0] < 0.0;  // beyond the seat where it turns
        if (turns && !sinks) {
            if (to[1] < 0.0) {
                if (found.passed++ >= task.transient) found.maxima.push_back(turned[0]);
                if (std::abs(turned[0] - last) < task.converged)
                    found.maxima.resize(task.recorded, turned[0]);
                if (found.maxima.size() == task.recorded) return found;
            }
            last = turned[0];
        }
        if (sinks || to[0] < 0.0) {
            const double start = turns && !sinks ? until : t0;
            const double at = crossing(stepper, 0, start, sinks ? until : t1, false);
            stepper.calc_state(at, to);
            if (found.impacts.size() < task.impacts) found.impacts.push_back(at);
            to = {0.0, -model.restitution * to[1], to[2]};
            last = 0.0;
            stepper.initialize(to, at, stepper.current_time_step());
        }
        from = to;
    }
}

void print(const std::vector<double>& values, std::size_t size) {
    for (std::size_t k = 0; k < size; ++k) std::printf(" %.17g", k < values.size() ? values[k] : missing);
}

int main(int count, char** arguments) {
    std::vector<double> given;
    for (int k = 1; k < count; ++k) given.push_back(std::atof(arguments[k]));
    constexpr std::size_t fixed = 12;
    if (given.size() <= fixed) return 2;
    const auto size = [&](int k) { return static_cast<std::size_t>(given[k]); };
    const Task task{given[0], given[11], size(1), size(2), size(3), {given[8], given[9], given[10]}};
    std::vector<Found> found;
    const std::clock_t begun = std::clock();
    for (std::size_t k = fixed; k < given.size(); ++k)
        found.push_back(run(Model{given[4], given[5], given[6], given[7], given[k]}, task));
    std::printf("%.17g\n", static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC);
    for (const Found& each : found) {
        std::printf("%zu", each.passed);
        print(each.impacts, task.impacts);
        print(each.maxima, task.recorded);
        std::printf("\n");
    }
}
