"""Processing of formulas: tracing of Python functions, tapes for the C++ part, derivatives."""

from . import _core
from .expressions import CONDITIONS, Expression, TimeFunction, _constant, _expression, _node, _power, _unary, cos, cosh, sin, sinh, sqrt, where


def trace(function, count, what):
    """Calls a Python function once with `count` formulas, and returns the formula it gives."""
    try:
        y = function(*[Expression("argument", (), k) for k in range(count)])
    except TypeError as error:
        raise TypeError("%s cannot be traced: %s" % (what, error)) from error
    return _expression(y)


def ordered(roots):
    """All nodes of the formulas `roots`, operands before the nodes that use them"""
    done, order, stack = set(), [], [(r, False) for r in reversed(roots)]
    while stack:
        node, ready = stack.pop()
        if id(node) in done:
            continue
        if ready:
            done.add(id(node))
            order.append(node)
        else:
            stack.append((node, True))
            stack.extend((x, False) for x in node.operands if id(x) not in done)
    return order


def compile_tape(roots, leaves, keep, arguments=None):
    """The tape of the formulas `roots`. leaves: number of the argument for each measure, by key(); nodes of kind `argument` contain their number.
    Objects that have to outlive the tape are appended to keep."""
    codes = _core.operations
    operations, constants, parameters, tables, functions = [], [], [], [], []
    register, known = {}, {}
    for n in ordered(roots):
        operands = tuple(register[id(x)] for x in n.operands)
        key = (n.op, operands, n.key() if n.op == "measure" else n.value if n.op in ("constant", "argument") else id(n.value))
        if key in known and n.op != "function":
            register[id(n)] = known[key]
            continue
        op, index = n.op, 0
        a, b, c = (operands + (0, 0, 0))[:3] if n.op != "function" else (0, 0, 0)
        if op == "constant":
            c, _ = len(constants), constants.append(n.value)
        elif op == "argument":
            c = n.value
        elif op == "measure":
            op, c = "argument", leaves[n.key()]
        elif op == "parameter":
            c, _ = len(parameters), parameters.append(n.value)
            keep.append(n)
        elif op in ("table", "table_rate", "table_curvature"):
            c, _ = len(tables), tables.append(n.value._core)
            keep.append(n.value)
        elif op == "function":
            c, _ = len(functions), functions.append((n.value.function, n.value.gradient, list(operands)))
            keep.append(n.value)
        register[id(n)] = known[key] = len(operations)
        operations.append((codes[op][0], a, b, c))
    count = arguments if arguments is not None else 1 + max(leaves.values(), default=-1)
    return _core.Tape(operations, constants, parameters, tables, functions, [register[id(r)] for r in roots], count)


def time_function(x, keep):
    """The library's function of time of a number, a `TimeFunction`, a formula of time or a Python function of t that can be traced."""
    if isinstance(x, TimeFunction):
        keep.append(x)
        return x._core
    if callable(x) and not isinstance(x, Expression):
        y = trace(x, 1, "a function of time")
        if any(n.op == "measure" for n in ordered([y])):
            raise TypeError("a function of time depends on its argument, which is the time, and on parameters alone, not on hhtdae.time() or other measures: "
                            "use the argument, or a UserConstraint with a formula of the measures")
        return compile_tape([y], {}, keep, 1).time_function()
    x = _expression(x)
    leaves = {n.key(): n for n in ordered([x]) if n.op == "measure"}
    if not leaves and not any(n.op == "parameter" for n in ordered([x])):
        return _core.TimeFunction(float(x))
    if any(n.value[0] != "time" for n in leaves.values()):
        raise TypeError("a function of time can be a formula of hhtdae.time() and of parameters, not of other measures")
    return compile_tape([x], {key: 0 for key in leaves}, keep, 1).time_function()


# ---- derivatives ----


def _chain(n, x):
    """Derivatives of a node by its operands"""
    op, one = n.op, _expression(1.)
    a = x[0]
    if op in ("add", "subtract"):
        return one, (one if op == "add" else _expression(-1.))
    if op == "multiply":
        return x[1], a
    if op == "divide":
        return 1. / x[1], -n / x[1]
    if op == "negate":
        return (_expression(-1.),)
    if op == "power":
        nothing = _node("equal", a, 0.)  # the derivative at 0 is set to 0, as for square roots
        by_base = x[1] * _power(a, x[1] - 1.)
        by_base = where(nothing & (x[1] < 1.), 0., by_base) if not (_constant(x[1]) or 0.) >= 1. else by_base
        return by_base, (_expression(0.) if _constant(x[1]) is not None else where(nothing, 0., n * _unary("log", a)))
    if op == "atan2":
        square = a * a + x[1] * x[1]
        return x[1] / square, -a / square
    if op == "hypot":
        return where(n <= 0, 0., a / n), where(n <= 0, 0., x[1] / n)
    if op in ("minimum", "maximum"):
        second = _node("less", x[1], a) if op == "minimum" else _node("less", a, x[1])
        return where(second, 0., 1.), where(second, 1., 0.)
    if op in ("table", "table_rate"):
        return (Expression("table_rate" if op == "table" else "table_curvature", (a,), n.value),)
    rules = {"sin": lambda: cos(a), "cos": lambda: -sin(a), "tan": lambda: 1. + n * n, "asin": lambda: 1. / sqrt(1. - a * a),
             "acos": lambda: -1. / sqrt(1. - a * a), "atan": lambda: 1. / (1. + a * a), "sinh": lambda: cosh(a), "cosh": lambda: sinh(a),
             "tanh": lambda: 1. - n * n, "exp": lambda: n, "log": lambda: 1. / a, "log10": lambda: 0.43429448190325182765 / a,
             "sqrt": lambda: where(n <= 0, 0., 0.5 / n),  # 0 at 0 as in dual.h, so that derivatives of products such as sqrt(v v) v are finite
             "cbrt": lambda: 1. / (3. * n * n), "abs": lambda: where(a < 0, -1., where(a <= 0, 0., 1.))}
    if op in rules:
        return (rules[op](),)
    raise TypeError("a formula with '%s' has no derivative here" % op)


def differentiate(roots, arguments):
    """The nonzero derivatives of formulas by arguments, as a dictionary {(number of the root, number of the argument): formula}"""
    order = ordered(roots)
    depends = {}
    for n in order:
        depends[id(n)] = {n.value} if n.op == "argument" else set().union(*[depends[id(x)] for x in n.operands]) if n.operands else set()
    factors, result = {}, {}
    for k in arguments:
        d = {}
        for n in order:
            if k not in depends[id(n)] or n.op in CONDITIONS:
                continue
            if n.op == "argument":
                d[id(n)] = _expression(1.)
                continue
            if n.op == "where":
                branches = [d.get(id(x), _expression(0.)) for x in n.operands[1:]]
                d[id(n)] = where(n.operands[0], *branches)
                continue
            if id(n) not in factors:
                factors[id(n)] = _chain(n, n.operands)
            total = _expression(0.)
            for f, x in zip(factors[id(n)], n.operands):
                if id(x) in d:
                    total = total + f * d[id(x)]
            d[id(n)] = total
        for r, root in enumerate(roots):
            if id(root) in d and _constant(d[id(root)]) != 0:
                result[r, k] = d[id(root)]
    return result
